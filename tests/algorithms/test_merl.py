"""MERL: whose reward gradients follow, who shares what, and who migrates; on a task whose best is known."""

import dataclasses
import functools
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import skillcrew as sc
from algorithms.test_independent import LEARNER
from oracles.aiming import AGENTS, COMMON, TARGETS, Aiming
from oracles.refusals import refusal, unhooked
from skillcrew.algorithms import merl as merl_module

POPULATION, EPISODES, NOISY, HIDDEN = 7, 2, 5, 32
SETTINGS: dict[str, Any] = {
    "population": POPULATION,
    "episodes": EPISODES,
    "learner_episodes": NOISY,
    "evolution": sc.EvolutionConfig(elites=2),
    "updates": 40,
    "exploration_noise": 0.5,
    "buffer_capacity": 6000,
    "learner": sc.TD3Config(
        **{**LEARNER, "network": sc.NetworkConfig(hidden=(HIDDEN,), input_scaling="none")}
    ),
}


class Signed(Aiming):
    """The same task; with a sign of -1 the team is paid for being far from the targets."""

    def __init__(self, sign: Any = 1.0):
        super().__init__()
        self.sign = sign

    def step(self, state, action, key):
        state, step = super().step(state, action, key)
        return state, dataclasses.replace(step, team_reward=self.sign * step.team_reward)


def acting(team: Any) -> np.ndarray:
    observation = jnp.full((AGENTS, 4), 0.5)
    action, _, choice = team.act(observation, team.initial_memory(), jax.random.key(0))
    assert choice.tolist() == [0] * AGENTS
    return np.asarray(action[:, 0])


def learned_actions(algorithm: sc.MERL, state: Any) -> np.ndarray:
    """What the learning team, which may never become champion, does."""
    migration = algorithm._migration
    learner = migration._make_team(jax.tree.map(lambda leaf: leaf[0], migration._teams(state.learning)))
    if algorithm.config.sharing == "trunk":
        learner = merl_module.IdentifiedTeam(learner)
    return acting(learner)


@functools.cache
def programs(**fields: Any) -> tuple[Any, Any]:
    """Its first state and its generation, of which the sign of the team's reward is an input."""

    def step(state, sign):
        return sc.MERL(Signed(sign), **SETTINGS, **fields).step(state)

    return jax.jit(sc.MERL(Signed(), **SETTINGS, **fields).init), jax.jit(step)


def lived(generations: int, sign: float = 1.0, **fields: Any) -> tuple[sc.MERL, Any, dict[str, Any]]:
    init, step = programs(**fields)
    state, told = init(jax.random.key(3)), []
    for _ in range(generations):
        state, metrics = step(state, sign)
        told.append(jax.device_get(metrics))
    return sc.MERL(Signed(), **SETTINGS, **fields), state, jax.tree.map(lambda *each: np.stack(each), *told)


@pytest.mark.parametrize("sharing", ["trunk", "agent"])
def test_gradients_never_see_the_teams_reward_and_evolution_never_sees_the_local_ones(sharing: str) -> None:
    """With the team's reward turned round, learners stay the same to the bit and elites do not."""
    _, plain, told = lived(1, sharing=sharing)
    _, contrary, told_contrary = lived(1, -1.0, sharing=sharing)
    for one, other in zip(
        jax.tree.leaves(plain.learning.learners), jax.tree.leaves(contrary.learning.learners), strict=True
    ):
        np.testing.assert_array_equal(one, other)
    assert told["critic_loss"] == told_contrary["critic_loss"] > 0
    assert told["fitness_mean"] == pytest.approx(-told_contrary["fitness_mean"], rel=1e-5)
    assert not np.array_equal(plain.search.genomes, contrary.search.genomes)


@pytest.mark.parametrize(
    ("sharing", "reward", "expected"),
    [
        ("trunk", {}, TARGETS),
        ("agent", {}, TARGETS),
        ("team", {}, [np.mean(TARGETS)] * AGENTS),
        ("agent", {"reward": "own+common"}, [(target + COMMON) / 2 for target in TARGETS]),
    ],
)
def test_learners_find_what_their_reward_asks_for_though_the_team_is_paid_for_the_contrary(
    sharing: str, reward: dict[str, str], expected: list[float]
) -> None:
    algorithm, state, metrics = lived(60, -1.0, sharing=sharing, **reward)
    np.testing.assert_allclose(learned_actions(algorithm, state), expected, atol=0.25)
    # The champion is the one who does best by the team's reward.
    assert metrics["champion_fitness"][-1] > metrics["learner_fitness"][-1] + 0.5
    worlds = POPULATION * EPISODES + EPISODES + NOISY
    np.testing.assert_array_equal(metrics["environment_steps"], 2 * worlds * np.arange(1, 61))
    assert metrics["transitions_held"][0] == 2 * worlds * AGENTS


@pytest.mark.parametrize("sharing", ["trunk", "agent"])
def test_a_team_of_the_learners_migrates_and_wins_where_both_rewards_agree(sharing: str) -> None:
    algorithm, state, metrics = lived(60, sharing=sharing)
    np.testing.assert_allclose(acting(algorithm.team(state)), TARGETS, atol=0.25)
    assert metrics["champion_fitness"][-1] > -0.08


def test_the_learning_team_takes_the_place_of_the_worst_in_its_generations_only() -> None:
    algorithm = sc.MERL(
        Aiming(),
        **{**SETTINGS, "evolution": sc.EvolutionConfig(elites=1)},
        sharing="agent",
        migration_period=2,
    )
    before, step = jax.jit(algorithm.init)(jax.random.key(4)), jax.jit(algorithm.step)
    for expected in (0, 1, 0):
        # Everybody else aims far off, so that the migrant is the one elite if it came.
        by_agent = jnp.zeros_like(before.search.genomes).reshape(POPULATION, AGENTS, -1)
        far = by_agent.at[..., -1].set(9.0).reshape(POPULATION, -1)
        search = dataclasses.replace(before.search, genomes=far)
        before = dataclasses.replace(before, search=search)
        after, _ = step(before)
        migration = algorithm._migration
        genome = migration._search.encode(
            jax.tree.map(lambda leaf: leaf[0], migration._teams(before.learning))
        )
        same = (np.asarray(after.search.genomes[0]) == np.asarray(genome)).all()
        assert int(same) == expected
        before = after


def test_agents_share_all_but_their_last_layer_or_nothing() -> None:
    seen = 4
    layer = seen * HIDDEN + HIDDEN
    for sharing, genes in {
        "trunk": layer + (HIDDEN + 1) * AGENTS,
        "agent": AGENTS * (layer + HIDDEN + 1),
        "team": layer + HIDDEN + 1,
    }.items():
        algorithm = sc.MERL(Aiming(), **SETTINGS, sharing=sharing)
        assert jax.eval_shape(algorithm.init, jax.random.key(0)).search.genomes.shape[1] == genes


def test_coevolution_evolves_the_teams_when_it_is_asked_to() -> None:
    fields = {"sharing": "agent", "evolver": "coevolution", "evolution": sc.EvolutionConfig(elites=2)}
    algorithm = sc.MERL(Aiming(), **{**SETTINGS, **fields})

    def run(key):
        return jax.lax.scan(lambda carry, _: algorithm.step(carry), algorithm.init(key), length=40)

    state, metrics = jax.jit(run)(jax.random.key(5))
    assert state.search.subpopulations.genomes.shape[:2] == (AGENTS, POPULATION)
    np.testing.assert_allclose(acting(algorithm.team(state)), TARGETS, atol=0.35)
    assert metrics["fitness_best"][-5:].mean() > metrics["fitness_best"][:5].mean()


def test_the_first_skill_is_learned_unless_another_reward_is_named() -> None:
    local, team = jnp.array([[3.0, 5.0]]), jnp.array([7.0])

    def learned(**fields: str) -> float:
        return float(sc.MERL(Aiming(), **fields)._migration._learning._reward(local, team)[0])

    assert learned() == 3
    assert learned(reward="common") == 5
    assert learned(reward="common+own") == 8


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        ({"reward": "team"}, ["reward = team", "never sees the team's reward"]),
        ({"reward": "own+team"}, ["reward = own+team", "never sees the team's reward"]),
        ({"sharing": "heads"}, ["unknown sharing 'heads'", "trunk"]),
        ({"migration_period": 0}, ["migration_period = 0: give at least 1 generation"]),
        ({"evolver": "strategy"}, ["evolver = strategy", "genetic or coevolution"]),
        ({"evolver": "coevolution"}, ["evolver = coevolution", "set sharing to agent", "trunk"]),
    ],
)
def test_refuses_options_that_cannot_be_meant(fields: dict[str, Any], expected: list[str]) -> None:
    message = refusal(unhooked(merl_module).MERLConfig, **fields)
    for part in expected:
        assert part in message


def test_refuses_a_reward_that_the_environment_lacks() -> None:
    with pytest.raises(sc.UserError) as refused:
        sc.MERL(Aiming(), reward="own+go_to_poi_A")
    assert "unknown reward 'go_to_poi_A'" in str(refused.value)
    assert "own" in str(refused.value).split("valid")[1]
