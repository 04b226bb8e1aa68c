"""A world for which nobody has written down a skill."""

import equinox as eqx
import jax
import jax.numpy as jnp
import pytest

import skillcrew as sc
from envs.test_check import Sound
from oracles.training import trained
from skillcrew.algorithms.registry import ALGORITHMS

PICKING = {"dqn"}  # Its actions are discrete, those of this world are not.
SELECTING = {"madys", "madys-plus", "madys-es", "open-loop", "mfl", "coma"}


class Unskilled(Sound):
    skills = ()

    def step(self, state, action, key):
        state, step = super().step(state, action, key)
        return state, eqx.tree_at(lambda step: step.local_rewards, step, jnp.zeros((self.n_agents, 0)))


@pytest.mark.parametrize("name", sorted(set(ALGORITHMS) - SELECTING - PICKING - {"merl"}))
def test_what_needs_no_skills_steps(name):
    algorithm = sc.make_algorithm(name, Unskilled())
    _, metrics = jax.eval_shape(lambda key: algorithm.step(algorithm.init(key)), jax.random.key(0))
    assert "fitness_best" in metrics


def test_one_of_them_learns_in_it():
    ea = sc.EA(Unskilled(), population=8, episodes=4, evolution=sc.EvolutionConfig(elites=2))
    mean = trained(ea, 15, lambda _: None)[1]["fitness_mean"]
    assert mean[-3:].mean() > max(mean[0], 0.3)


@pytest.mark.parametrize("name", sorted(SELECTING))
def test_what_selects_among_skills_says_what_to_use(name):
    with pytest.raises(sc.UserError, match=r"unskilled has no skills to select among; .* ea, ccea, erl"):
        sc.make_algorithm(name, Unskilled())


@pytest.mark.parametrize("reward", ["local", "first"])
def test_a_local_reward_is_not_there(reward):
    with pytest.raises(sc.UserError, match=rf"reward = {reward}: unskilled has no skills"):
        sc.MERL(Unskilled(), reward=reward)
    with pytest.raises(sc.UserError, match="unknown reward 'approach'"):
        sc.IndependentTD3(Unskilled(), reward="approach")
