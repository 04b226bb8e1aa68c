"""ERL: who lives, who migrates when, and that both halves learn; on a task whose best actions are known."""

import dataclasses
import itertools
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import skillcrew as sc
from algorithms.test_independent import LEARNER
from oracles.aiming import AGENTS, TARGETS, Aiming

POPULATION, EPISODES, NOISY, PERIOD = 9, 4, 2, 3
WRONG = (3.0, -3.0, -3.0)


@pytest.fixture(scope="module")
def erl() -> sc.ERL:
    return sc.ERL(
        Aiming(),
        population=POPULATION,
        episodes=EPISODES,
        learner_episodes=NOISY,
        migration_period=PERIOD,
        evolution=sc.EvolutionConfig(elites=1, mutation=sc.MutationConfig(probability=0.0)),
        updates=20,
        exploration_noise=0.5,
        buffer_capacity=3000,
        learner=sc.TD3Config(**LEARNER),
    )


@pytest.fixture(scope="module")
def generations(erl) -> list[tuple[Any, dict[str, Any]]]:
    """States and metrics of some generations, all teams of which shoot the wrong way and never mutate."""
    state = jax.jit(erl.init)(jax.random.key(0))
    # A network's biases come last, and those of its last layer at the very end.
    wrong = jnp.zeros_like(state.search.genomes).at[:, -AGENTS:].set(jnp.array(WRONG)[None])
    search = dataclasses.replace(state.search, genomes=wrong)
    state = dataclasses.replace(state, search=search)
    step = jax.jit(erl.step)
    lived = [(state, {})]
    for _ in range(2 * PERIOD):
        state, metrics = step(lived[-1][0])
        lived.append((state, jax.device_get(metrics)))
    return lived


def actions(erl: sc.ERL, state: Any) -> np.ndarray:
    team = erl.team(state)
    action, _, choice = team.act(jnp.full((AGENTS, 4), 0.5), team.initial_memory(), jax.random.key(0))
    assert choice.tolist() == [0] * AGENTS
    return np.asarray(action[:, 0])


def learned_genome(erl: sc.ERL, state: Any) -> np.ndarray:
    return np.asarray(erl._migration._search.encode(erl._migration._learning.actors(state.learning)))


def test_the_joint_actor_moves_every_agent(erl, generations) -> None:
    np.testing.assert_allclose(actions(erl, generations[0][0]), np.tanh(WRONG), rtol=1e-5)


def test_everybody_lives_and_is_counted(generations) -> None:
    """Two steps in each world: the population's, the learner's own, and its noisy ones."""
    worlds = POPULATION * EPISODES + EPISODES + NOISY
    for number, (_, metrics) in enumerate(generations[1:], 1):
        assert metrics["environment_steps"] == 2 * worlds * number
        assert metrics["transitions_held"] == 2 * worlds * number


def test_the_learner_migrates_in_its_generations_only_and_takes_the_place_of_the_worst(
    erl, generations
) -> None:
    """A learner better than everybody is the one elite after a migration, and nowhere before."""
    came = []
    for (before, _), (after, metrics) in itertools.pairwise(generations):
        genome = learned_genome(erl, before)
        came.append(bool((np.asarray(after.search.genomes) == genome).all(1).any()))
        if not any(came):
            assert metrics["learner_fitness"] > metrics["fitness_best"]
        if came[-1]:
            np.testing.assert_array_equal(after.search.genomes[0], genome)
            assert metrics["champion_fitness"] == pytest.approx(float(metrics["learner_fitness"]), rel=1e-5)
            break
    assert came == [False, False, True]


def test_fitness_is_the_team_reward_and_never_the_learners(erl, generations) -> None:
    """Teams that all shoot alike have the fitness that their distances give."""
    _, metrics = generations[1]
    discount = erl.config.fitness_discount
    expected = -np.mean((np.tanh(WRONG) - np.array(TARGETS)) ** 2) * (1 + discount)
    assert metrics["fitness_best"] == pytest.approx(expected, rel=1e-4)
    assert metrics["fitness_mean"] == pytest.approx(expected, rel=1e-4)


def test_it_finds_the_targets(erl) -> None:
    def run(key):
        return jax.lax.scan(lambda carry, _: erl.step(carry), erl.init(key), length=60)

    state, metrics = jax.jit(run)(jax.random.key(1))
    np.testing.assert_allclose(actions(erl, state), TARGETS, atol=0.3)
    assert metrics["learner_fitness"][-10:].mean() > metrics["learner_fitness"][:10].mean()


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        ({"migration_period": 0}, ["migration_period = 0: give at least 1"]),
        ({"learner_episodes": 0}, ["learner_episodes = 0: give at least 1 episode"]),
        ({"evolver": "strategy"}, ["evolver = strategy", "set it to genetic or coevolution"]),
        ({"reward": "nothing"}, ["unknown reward 'nothing'", "team"]),
        ({"population": 3}, ["population = 3"]),
        ({"updates": 1}, ["updates = 1", "policy_delay"]),
        ({"buffer_capacity": 411}, ["buffer_capacity = 411: smaller than the 412 transitions"]),
    ],
)
def test_refuses_what_cannot_be_meant(fields: dict[str, Any], expected: list[str]) -> None:
    with pytest.raises(sc.UserError) as refused:
        sc.ERL(Aiming(), **fields)
    for part in expected:
        assert part in str(refused.value)
