"""Agents that differ as if they were alike: rows of zeros behind what is shorter, for arrays of one shape."""

from collections.abc import Mapping

import jax.numpy as jnp
from jaxtyping import Array, Float

from skillcrew.envs.agent_type import AgentType
from skillcrew.envs.environment import Environment
from skillcrew.envs.wrapper import Wrapper


def uniform(env: Environment) -> Environment:
    """The same world with arrays over all agents; one whose agents are alike is that already."""
    return Padded(env) if env.types else env


def types_of_agents(env: Environment) -> tuple[int, ...]:
    """The index of each agent's type; empty where agents are alike."""
    return tuple(index for index, kind in enumerate(env.types) for _ in range(kind.agents))


class Padded(Wrapper):
    """An environment of agents that differ, with the agents of all types in one row, type by type.

    Observations and local rewards end in zeros where another type has more, and of an action each agent
    takes what its type has. A discrete action beyond an agent's own counts from its first one again, so
    that there is none that means nothing.
    """

    def transform_observation(self, observation: Mapping[str, Array]) -> Float[Array, "agents obs *worlds"]:
        return in_rows(self.env.types, observation)

    def transform_action(self, action: Array) -> dict[str, Array]:
        return by_type(self.env.types, action, discrete=bool(self.choices))

    def transform_rewards(self, local_rewards: Mapping[str, Array]) -> Float[Array, "agents skills *worlds"]:
        """Each type's skills in columns of their own, which are 0 for the agents of other types."""
        rows, before = [], 0
        for kind in self.env.types:
            behind = len(self.skills) - before - len(kind.skills)
            rows.append(_padded(local_rewards[kind.name], before, behind))
            before += len(kind.skills)
        return jnp.concatenate(rows)


def in_rows(kinds: tuple[AgentType, ...], of_types: Mapping[str, Array]) -> Float[Array, "agents ..."]:
    """All agents' numbers, a row each, with zeros behind where a type has fewer."""
    size = max(of_types[kind.name].shape[1] for kind in kinds)
    rows = [_padded(of_types[kind.name], 0, size - of_types[kind.name].shape[1]) for kind in kinds]
    return jnp.concatenate(rows)


def by_type(kinds: tuple[AgentType, ...], action: Array, discrete: bool) -> dict[str, Array]:
    """Each type's own part of all agents' actions.

    Args:
        action: [agents, ...] if discrete, else [agents, act, ...].
    """
    parts, first = {}, 0
    for kind in kinds:
        own = action[first : first + kind.agents]
        parts[kind.name] = own % kind.action_size if discrete else own[:, : kind.action_size]
        first += kind.agents
    return parts


def _padded(rows: Array, before: int, behind: int) -> Array:
    return jnp.pad(rows, ((0, 0), (before, behind), *((0, 0),) * (rows.ndim - 2)))
