"""Agents of a JaxMARL environment in groups that are alike, and their actions and observations as arrays."""

import dataclasses
import re
from collections.abc import Mapping, Sequence
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from skillcrew.errors import UserError


@dataclasses.dataclass(frozen=True)
class Group:
    """Agents that see as much, do as much, and are called alike."""

    name: str
    agents: tuple[str, ...]
    observation_size: int
    action_size: int
    spaces: tuple[Any, ...]
    """Of actions, one for each agent."""

    def observed(self, observation: Mapping[str, Array]) -> Float[Array, "agents obs"]:
        """One row of numbers for each agent, whatever the shape of what it sees."""
        return jnp.stack([observation[agent].reshape(-1).astype(jnp.float32) for agent in self.agents])

    def acted(self, action: Array) -> dict[str, Array]:
        """Actions as JaxMARL takes them.

        Args:
            action: Int[agents], indices, or Float[agents, act] in [-1, 1], to be scaled to the agents' boxes.
        """
        return {
            agent: _in_space(space, action[index])
            for index, (agent, space) in enumerate(zip(self.agents, self.spaces, strict=True))
        }


def groups_of(world: Any, observation: Mapping[str, Any]) -> tuple[Group, ...]:
    """The groups, in the order of their first agents.

    Args:
        observation: of a reset; shapes are enough.

    Raises:
        UserError: agents whose observations or actions are of kinds that skillcrew has not.
    """
    found: dict[tuple[str, int, int], list[str]] = {}
    spaces = {agent: world.action_space(agent) for agent in world.agents}
    for agent in world.agents:
        size = int(np.prod(observation[agent].shape))
        found.setdefault((_stem(agent), size, _size_of(agent, spaces[agent])), []).append(agent)
    if len({is_discrete(space) for space in spaces.values()}) > 1:
        raise UserError(
            f"{world.name}: some agents' actions are discrete and some continuous; skillcrew takes one kind"
        )
    stems = [stem for stem, _, _ in found]
    return tuple(
        Group(
            stem if stems.count(stem) == 1 else agents[0],
            tuple(agents),
            seen,
            done,
            tuple(spaces[agent] for agent in agents),
        )
        for (stem, seen, done), agents in found.items()
    )


def is_discrete(space: Any) -> bool:
    """Whether actions are indices."""
    return hasattr(space, "n")


def check_observations(env_id: str, agents: Sequence[Any], observation: Any) -> None:
    """Raises `UserError` where there is not an array for each agent, as JaxMARL's own interface has it."""
    if isinstance(observation, Mapping) and all(hasattr(observation.get(agent), "shape") for agent in agents):
        return
    raise UserError(
        f"{env_id}: its observations are no dictionary with one array for each agent, so that it does not "
        "follow JaxMARL's own interface and cannot be used"
    )


def _stem(agent: str) -> str:
    """A name without the number behind it."""
    return re.sub(r"_?\d+$", "", str(agent)) or "agent"


def _size_of(agent: str, space: Any) -> int:
    if is_discrete(space):
        return int(space.n)
    if not (hasattr(space, "low") and hasattr(space, "high")):
        raise UserError(
            f"{agent}: its actions are a {type(space).__name__}; skillcrew takes Discrete and Box alone"
        )
    if not (np.isfinite(space.low).all() and np.isfinite(space.high).all()):
        raise UserError(f"{agent}: its actions have no bounds (low = {space.low}, high = {space.high})")
    return int(np.prod(space.shape))


def _in_space(space: Any, action: Array) -> Array:
    if is_discrete(space):
        return action
    low, high = (jnp.broadcast_to(jnp.float32(bound), space.shape) for bound in (space.low, space.high))
    return (low + (action.reshape(space.shape) + 1.0) * 0.5 * (high - low)).astype(space.dtype)
