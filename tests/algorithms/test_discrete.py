"""Discrete actions: who serves them, who does not, and that skills and actors learn them."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import skillcrew as sc
from oracles.picking import AGENTS, CHOICES, LENGTH, Picking
from oracles.toy import Toy
from oracles.training import trained
from skillcrew.algorithms.registry import ALGORITHMS
from skillcrew.envs.environment import Environment
from skillcrew.learners.dqn import DQNConfig
from skillcrew.policies.exploration import with_random_ones
from skillcrew.rollout import Lineup, Start, rollout

CONTINUOUS_ONLY = ("ddpg", "td3")


@pytest.mark.parametrize("name", sorted(set(ALGORITHMS) - set(CONTINUOUS_ONLY)))
def test_everybody_else_steps_and_acts(name):
    env = Picking()
    algorithm = sc.make_algorithm(name, env)

    def play(key):
        state, metrics = algorithm.step(algorithm.init(key))
        team = algorithm.team(state)
        return metrics, team.act(jnp.zeros((AGENTS, CHOICES)), team.initial_memory(), key)[0]

    metrics, action = jax.eval_shape(play, jax.random.key(0))
    assert "fitness_best" in metrics
    assert (action.shape, action.dtype) == ((AGENTS,), jnp.int32)


@pytest.mark.parametrize("name", CONTINUOUS_ONLY)
def test_who_gives_continuous_actions_names_those_who_do_not(name):
    with pytest.raises(sc.UserError, match=rf"{name}: gives continuous .*picking are discrete; use dqn"):
        sc.make_algorithm(name, Picking())


def test_who_picks_refuses_continuous_actions():
    with pytest.raises(sc.UserError, match=r"dqn: picks one of several .*toy are continuous; use td3"):
        sc.make_algorithm("dqn", Toy())


def test_skills_and_selectors_learn_together():
    network = sc.NetworkConfig(hidden=(16,), input_scaling="none")
    algorithm = sc.MADyS(
        Picking(),
        population=12,
        episodes=2,
        fitness_discount=1.0,
        exploration_noise=0.1,
        probe_episodes=2,
        updates=40,
        dqn=DQNConfig(discount=0.0, learning_rate=1e-2, soft_update=0.1, batch_size=32, network=network),
        evolution=sc.EvolutionConfig(elites=2),
        selector=sc.SelectorConfig(hidden=()),
    )

    def pick(state):
        # Each skill takes the action that it is paid for, whatever it is shown.
        skills, shown = state.skills.in_use(), jnp.eye(CHOICES)
        return jnp.argmax(jax.vmap(lambda skill: jax.vmap(skill)(shown))(skills), axis=-1)

    picked, metrics = trained(algorithm, 25, pick)
    assert float(metrics["champion_fitness"][-1]) > 0.75
    np.testing.assert_array_equal(picked, [np.arange(CHOICES), (np.arange(CHOICES) + 1) % CHOICES])


def test_independent_dqn_and_the_joint_one_of_erl_learn():
    network = sc.NetworkConfig(hidden=(16,), input_scaling="none")
    dqn = DQNConfig(discount=0.0, learning_rate=1e-2, batch_size=64, network=network)
    for kind, returns in ((sc.IndependentDQN, "fitness_mean"), (sc.ERL, "learner_fitness")):
        algorithm = kind(Picking(), reward="team", updates=100, exploration_noise=0.3, dqn=dqn)
        _, metrics = trained(algorithm, 12, lambda _: None)
        # By chance it is a quarter; a third of the actions of who explores are random.
        assert float(metrics[returns][-1]) > 0.55, kind


class Still(Picking):
    """Everybody is always shown the first action."""

    def reset(self, key):
        state, seen = super().reset(key)
        return {**state, "wanted": jnp.zeros_like(state["wanted"])}, jnp.zeros_like(seen)

    def step(self, state, action, key):
        after, step = super().step({**state, "wanted": jnp.zeros_like(state["wanted"])}, action, key)
        return after, dataclasses.replace(step, observation=jnp.zeros_like(step.observation))


class Counting:
    """Agents pick their own number."""

    def initial_memory(self):
        return ()

    def act(self, observation, memory, key):
        return jnp.arange(AGENTS, dtype=jnp.int32), memory, jnp.zeros(AGENTS, jnp.int32)


def test_what_was_picked_is_recorded_and_sometimes_random():
    env: Environment = Still()
    start = Start.draw(env, jax.random.key(0), 200)
    lineup = Lineup.of_team(Counting(), start)
    _, lived = rollout(env, lineup, jax.random.key(1))
    assert lived.action.shape == (LENGTH, 200, AGENTS, CHOICES)
    np.testing.assert_array_equal(lived.action[2, 7], np.eye(CHOICES)[:AGENTS])
    np.testing.assert_array_equal(lived.local_rewards[3, 5, :, 0], [1, 0, 0])
    _, noisy = rollout(env, lineup, jax.random.key(1), noise=0.4)
    picked = np.asarray(noisy.action.argmax(-1))
    np.testing.assert_array_equal(noisy.action.sum(-1), np.ones(picked.shape))
    # A random action is the intended one in one of four cases.
    assert np.mean(picked != np.arange(AGENTS)) == pytest.approx(0.4 * 3 / 4, abs=0.03)
    np.testing.assert_array_equal(noisy.local_rewards[..., 0], picked == 0)


def test_random_actions_are_as_likely_as_asked_for():
    taken = jnp.zeros((4000,), jnp.int32)
    picked = np.asarray(with_random_ones(jax.random.key(0), taken, 1.0, CHOICES))
    np.testing.assert_allclose(np.bincount(picked) / 4000, [0.25] * CHOICES, atol=0.03)
    np.testing.assert_array_equal(with_random_ones(jax.random.key(0), taken, 0.0, CHOICES), taken)


def test_only_the_learner_in_use_is_written_down():
    from skillcrew.experiment.config import RunConfig, to_yaml

    assert "\n  dqn:\n" in to_yaml(sc.MADyS(Picking()), RunConfig())
    assert "\n  learner:\n" not in to_yaml(sc.MADyS(Picking()), RunConfig())
    assert "\n  dqn:\n" not in to_yaml(sc.MADyS(Toy()), RunConfig())
