"""A team of agents that differ, as users of such an environment meet it."""

from collections.abc import Mapping

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Int, Key, PyTree

from skillcrew.envs.agent_type import AgentType
from skillcrew.envs.padded import by_type, in_rows
from skillcrew.policies.team import Team


class TeamByType(eqx.Module):
    """Acts as a `Team` does, on dictionaries with an array for each type of agents, by its name."""

    team: Team
    types: tuple[AgentType, ...] = eqx.field(static=True)
    choices: int = eqx.field(static=True)
    """Discrete actions that each decision is made among; 0 for continuous actions."""

    def initial_memory(self) -> PyTree:
        return self.team.initial_memory()

    def act(
        self, observation: Mapping[str, Array], memory: PyTree, key: Key[Array, ""]
    ) -> tuple[dict[str, Array], PyTree, dict[str, Int[Array, " agents"]]]:
        """Each agent's primitive action, the new memory, and each agent's choice."""
        action, memory, choice = self.team.act(in_rows(self.types, observation), memory, key)
        by_name = by_type(self.types, action, discrete=bool(self.choices))
        return by_name, memory, _split(self.types, choice)


def _split(types: tuple[AgentType, ...], choice: Array) -> dict[str, Array]:
    ends = [sum(kind.agents for kind in types[: index + 1]) for index in range(len(types) - 1)]
    parts = jnp.split(choice, ends)
    return {kind.name: part for kind, part in zip(types, parts, strict=True)}
