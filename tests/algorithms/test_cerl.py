"""CERL: a portfolio over horizons learns from one buffer, and its resources follow who does well."""

import dataclasses
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import skillcrew as sc
from algorithms.test_independent import LEARNER
from oracles.refusals import refusal, unhooked
from skillcrew.algorithms import cerl as cerl_module
from skillcrew.envs.environment import Environment, TimeStep

POPULATION, EPISODES, SLOTS = 9, 2, 6
DISCOUNTS = (0.0, 0.5, 0.95)


class Patience(Environment):
    """Two steps: an action of -1 in the first pays 0.2 at once, one of +1 pays 1 in the second.

    A learner that does not look ahead goes for the little, and one that does goes for the much.
    """

    name = "patience"
    n_agents, observation_size, action_size, episode_length = 2, 3, 1, 2
    skills = ("nothing",)

    def reset(self, key):
        del key
        state = jnp.full((2, 3), 0.5)
        return state, state

    def step(self, state, action, key):
        del key
        is_first = state[0, 0] > 0.2
        bet = action[:, 0].mean()
        # The second state tells how much was waited for.
        after = jnp.stack([jnp.full(2, -1.0), jnp.full(2, bet), jnp.zeros(2)], axis=1)
        reward = jnp.where(is_first, 0.1 * (1 - bet), 0.5 * (1 + state[0, 1]))
        done = ~is_first
        return after, TimeStep(after, jnp.zeros((2, 1)), reward, done, done & False)


SETTINGS: dict[str, Any] = {
    "env": Patience(),
    "population": POPULATION,
    "episodes": EPISODES,
    "learner_episodes": SLOTS,
    "discounts": DISCOUNTS,
    "migration_period": 3,
    "evolution": sc.EvolutionConfig(elites=2),
    "updates": 20,
    "exploration_noise": 0.5,
    "buffer_capacity": 3000,
    "learner": sc.TD3Config(**LEARNER),
}


@pytest.fixture(scope="module")
def cerl() -> sc.CERL:
    return sc.CERL(**SETTINGS)


@pytest.fixture(scope="module")
def trained(cerl) -> tuple[Any, dict[str, Any]]:
    def run(key):
        return jax.lax.scan(lambda carry, _: cerl.step(carry), cerl.init(key), length=60)

    state, metrics = jax.jit(run)(jax.random.key(0))
    return state, jax.device_get(metrics)


def first_bets(cerl: sc.CERL, state: Any) -> np.ndarray:
    """What each learner does first, on average over the agents that it moves."""
    actors = cerl._migration._learning.actors(state.lived.learning)
    seen = jnp.full(6, 0.5)
    return np.asarray(jnp.tanh(jax.vmap(lambda actor: actor(seen, jnp.zeros(0))[0])(actors)).mean(1))


def test_each_learner_looks_ahead_as_far_as_its_discount(cerl, trained) -> None:
    """0.2 now or γ later: only the first learner takes the 0.2."""
    bets = first_bets(cerl, trained[0])
    assert bets[0] < -0.5 and bets[1] > 0.5 and bets[2] > 0.5


def test_the_budget_moves_to_the_learners_that_do_better(trained) -> None:
    _, metrics = trained
    episodes = np.array([metrics[f"episodes_{discount}"] for discount in DISCOUNTS])
    np.testing.assert_array_equal(episodes.sum(0), SLOTS * np.arange(1, 61))
    assert episodes[:, 0].tolist() == [2, 2, 2], "at first they go round"
    late = episodes[:, -1] - episodes[:, 29]
    assert late[0] < 0.7 * late[1:].min()
    assert late[0] > 0, "nobody is given up"
    assert metrics["value_0.0"][-1] < 0.6 < 0.7 < metrics["value_0.95"][-1]


def test_everybody_is_counted_and_fills_one_buffer(trained) -> None:
    _, metrics = trained
    worlds = POPULATION * EPISODES + len(DISCOUNTS) * EPISODES + SLOTS
    np.testing.assert_array_equal(metrics["environment_steps"], 2 * worlds * np.arange(1, 61))
    assert metrics["transitions_held"][[0, -1]].tolist() == [2 * worlds, 3000]


def test_all_learners_migrate_in_their_generation() -> None:
    """They take the places of the worst: among teams that bet on the little, all of them become elites."""
    elites = len(DISCOUNTS) + 1
    cerl = sc.CERL(**{**SETTINGS, "evolution": sc.EvolutionConfig(elites=elites), "updates": 2})
    state = jax.jit(cerl.init)(jax.random.key(2))
    step = jax.jit(cerl.step)
    # The biases of the two agents' actions come last.
    poor = jnp.zeros_like(state.lived.search.genomes).at[:, -2:].set(-9.0)
    search = dataclasses.replace(state.lived.search, genomes=poor)
    state = dataclasses.replace(state, lived=dataclasses.replace(state.lived, search=search))
    came = []
    for _ in range(3):
        learners = cerl._migration._teams(state.lived.learning)
        genomes = np.asarray(jax.vmap(cerl._migration._search.encode)(learners))
        state, _ = step(state)
        population = np.asarray(state.lived.search.genomes)
        came.append(sum(bool((population == genome).all(1).any()) for genome in genomes))
    assert came == [0, 0, len(DISCOUNTS)]


def test_the_champion_waits(cerl, trained) -> None:
    team = cerl.team(trained[0])
    action, _, choice = team.act(jnp.full((2, 3), 0.5), team.initial_memory(), jax.random.key(0))
    assert action.shape == (2, 1) and choice.tolist() == [0, 0]
    assert float(action.mean()) > 0.7


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        ({"discounts": (0.9,)}, ["discounts = (0.9,)", "portfolio of 1", "at least 2", "use erl"]),
        ({"discounts": (0.9, 1.0)}, ["discounts = (0.9, 1.0)", "from 0 to below 1"]),
        ({"learner_episodes": 3}, ["learner_episodes = 3: fewer than the 4 learners", "at least one"]),
        ({"migration_period": 0}, ["migration_period = 0: give at least 1 generation"]),
    ],
)
def test_refuses_what_cannot_be_meant(fields: dict[str, Any], expected: list[str]) -> None:
    message = refusal(unhooked(cerl_module).CERLConfig, **fields)
    for part in expected:
        assert part in message


def test_a_population_must_have_room_for_the_portfolio() -> None:
    evolution = sc.EvolutionConfig(elites=1)
    with pytest.raises(sc.UserError) as refused:
        sc.CERL(Patience(), population=4, evolution=evolution)
    assert "population = 4: no larger than the 4 learners" in str(refused.value)
