"""Difference rewards: what each agent added to the team's reward (thesis, sections 2.1.5.1 and 2.1.5.2)."""

import dataclasses
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Key, PyTree

from skillcrew.credit.counterfactuals import Counterfactuals, with_more_of_each, without_each
from skillcrew.envs.environment import Environment, TimeStep
from skillcrew.envs.padded import uniform
from skillcrew.envs.wrapper import Wrapper

CREDITS = ("D", "D++")
"""Rewards that credit each agent with its part of the team's: the difference reward, and D++."""


def difference(
    reward: Float[Array, "*worlds"], without: Float[Array, "agents *worlds"]
) -> Float[Array, "agents *worlds"]:
    """D_i = G(z) - G(z_-i): what the team would miss without each agent (Wolpert and Tumer 2002).

    Args:
        without: the team's reward without each of the agents.
    """
    return reward[None] - without


def difference_with_more(
    reward: Float[Array, "*worlds"],
    without: Float[Array, "agents *worlds"],
    more: Float[Array, "counts agents *worlds"],
) -> Float[Array, "agents *worlds"]:
    """D++: where an agent alone adds nothing, what it would add with helpers like it.

    D++^n_i = (G(z with n more of i) - G(z)) / n. As its authors search for n (Rahmattalabi et al. 2016):
    D, if as many helpers as there are other agents add no more than that. Else n grows from 1 as long as
    D++^n does not fall, D counting as that of n = 0, and the last before it falls is taken.

    Args:
        more: with 1, 2, … more of each, up to as many as there are other agents.
    """
    alone = difference(reward, without)
    counts = jnp.arange(1, len(more) + 1, dtype=reward.dtype).reshape(-1, *(1,) * alone.ndim)
    each = jnp.concatenate([alone[None], (more - reward[None, None]) / counts])
    falls = each[1:] < each[:-1]
    # The first fall; the last n where there is none.
    stop = jnp.where(falls.any(0), falls.argmax(0), len(more))
    found = jnp.take_along_axis(each, stop[None], axis=0)[0]
    return jnp.where(each[-1] <= alone, alone, found)


class CreditedState(eqx.Module):
    """A world, and what differs in those of other teams."""

    world: Any
    others: Any
    """Leaves have a leading team axis."""


class Credited(Wrapper):
    """The same world, in which each agent is also paid its credit, as the last of its local rewards.

    Args:
        env: offers counterfactual steps.
        credit: "D" or "D++"; what the local reward is called, too.

    Raises:
        UserError: the environment does not offer them.
    """

    def __init__(self, env: Environment, credit: str):
        super().__init__(uniform(env))
        self.credit = credit
        self.skills = (*self.env.skills, credit)
        copies = without_each(env.n_agents)
        if credit == "D++" and env.n_agents > 1:
            copies = np.concatenate([copies, with_more_of_each(env.n_agents, env.n_agents - 1)])
        self._teams = Counterfactuals(self.env, copies, f"reward = {credit}")

    def transform_observation(self, observation: Any) -> Float[Array, "agents obs *worlds"]:
        return observation

    def reset(self, key: Key[Array, ""]) -> tuple[PyTree, Float[Array, "agents obs"]]:
        world, observation = self.env.reset(key)
        return CreditedState(world, self._teams.begin(world)), observation

    def reset_worlds(self, keys: Key[Array, " worlds"]) -> tuple[PyTree, Float[Array, "agents obs worlds"]]:
        worlds, observation = self.env.reset_worlds(keys)
        return CreditedState(worlds, self._teams.begin_worlds(worlds)), observation

    def step(self, state: PyTree, action: Array, key: Key[Array, ""]) -> tuple[PyTree, TimeStep]:
        world, step = self.env.step(state.world, action, key)
        return self._paid(world, step, *self._teams.step(state.world, state.others, action, key))

    def step_worlds(
        self, state: PyTree, action: Array, keys: Key[Array, " worlds"]
    ) -> tuple[PyTree, TimeStep]:
        world, step = self.env.step_worlds(state.world, action, keys)
        return self._paid(world, step, *self._teams.step_worlds(state.world, state.others, action, keys))

    def _paid(
        self, world: PyTree, step: TimeStep, others: PyTree, paid: Float[Array, "teams *worlds"]
    ) -> tuple[CreditedState, TimeStep]:
        credit = self._credit(step.team_reward, paid)[:, None]
        local_rewards = jnp.concatenate([step.local_rewards, credit], axis=1)
        return CreditedState(world, others), dataclasses.replace(step, local_rewards=local_rewards)

    def _credit(
        self, reward: Float[Array, "*worlds"], paid: Float[Array, "teams *worlds"]
    ) -> Float[Array, "agents *worlds"]:
        without = paid[: self.n_agents]
        if len(paid) == len(without):
            return difference(reward, without)
        more = paid[self.n_agents :].reshape(-1, *without.shape)
        return difference_with_more(reward, without, more)


def credited(env: Environment, reward: str) -> Environment:
    """The environment itself, or with credits if that is the reward that somebody learns from."""
    return Credited(env, reward) if reward in CREDITS else env
