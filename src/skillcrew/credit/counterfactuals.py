"""Worlds with other teams, which run beside the one that is lived in."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int, Key, PyTree

from skillcrew.envs.environment import Environment
from skillcrew.envs.offers import OffersCounterfactuals, require
from skillcrew.envs.wrapper import Wrapper

Copies = Int[np.ndarray, "teams agents"]
"""How often each agent is in each of some teams."""


def without_each(n_agents: int) -> Copies:
    """A team without each of the agents."""
    return 1 - np.eye(n_agents, dtype=np.int32)


def with_more_of_each(n_agents: int, most: int) -> Copies:
    """Teams with one more of each of the agents, then those with two more, up to `most`."""
    more = np.eye(n_agents, dtype=np.int32)
    return np.concatenate([1 + times * more for times in range(1, most + 1)])


class Counterfactuals:
    """What other teams would have been paid, step by step, had all others done what they did.

    Each team has a world of its own that goes on from step to step, so that the sum over an episode is what
    that team's episode would have been worth: who was missing in the beginning is missed in the end.

    Args:
        env: offers counterfactual steps.
        copies: of each team.
        needed_by: what asks for it, for the message.

    Raises:
        UserError: the environment does not offer them.
    """

    def __init__(self, env: Environment, copies: Copies, needed_by: str):
        self._env = env
        self._copies = copies
        self._offered = require(env, OffersCounterfactuals, needed_by)

    def begin(self, state: PyTree) -> PyTree:
        """What differs in the worlds of all teams: nothing yet. Leaves have a leading team axis."""
        teams, other = len(self._copies), self._offered.counterfactual(state)
        return jax.tree.map(lambda leaf: jnp.broadcast_to(leaf[None], (teams, *leaf.shape)), other)

    def begin_worlds(self, states: PyTree) -> PyTree:
        """The same beside many worlds, whose axis is the last one."""
        return jax.vmap(self.begin, in_axes=-1, out_axes=-1)(states)

    def step(
        self, state: PyTree, others: PyTree, action: Array, key: Key[Array, ""]
    ) -> tuple[PyTree, Float[Array, " teams"]]:
        """What differs after a step of the agents, and what each team is paid for it.

        Args:
            state: of the world that is lived in, before the step.
        """
        given = self._inner(action)

        def of_team(other: PyTree, copies: Int[Array, " agents"]) -> tuple[PyTree, Float[Array, ""]]:
            return self._offered.counterfactual_step(state, other, given, key, copies)

        return jax.vmap(of_team)(others, jnp.asarray(self._copies))

    def step_worlds(
        self, states: PyTree, others: PyTree, action: Array, keys: Key[Array, " worlds"]
    ) -> tuple[PyTree, Float[Array, "teams worlds"]]:
        """The same beside many worlds, whose axis is the last one."""
        return jax.vmap(self.step, in_axes=(-1, -1, -1, 0), out_axes=-1)(states, others, action, keys)

    def _inner(self, action: Array) -> Any:
        """What the environment inside all wrappers is told."""
        env: Any = self._env
        while isinstance(env, Wrapper):
            action, env = env.transform_action(action), env.env
        return action
