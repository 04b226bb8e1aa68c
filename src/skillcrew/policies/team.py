"""What acts in an environment, whatever algorithm made it."""

from typing import Protocol, runtime_checkable

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, Key, PyTree

from skillcrew.policies.actor import Actor
from skillcrew.policies.selector import Selector


@runtime_checkable
class Team(Protocol):
    """A pytree that acts for all agents of one world; scoring and reports know no more than this."""

    def initial_memory(self) -> PyTree:
        """What the team remembers at the start of an episode."""
        ...

    def act(
        self, observation: Float[Array, "agents obs"], memory: PyTree, key: Key[Array, ""]
    ) -> tuple[Float[Array, "agents act"], PyTree, Int[Array, " agents"]]:
        """Each agent's primitive action in [-1, 1], the new memory, and each agent's choice.

        The choice is the index of the chosen skill, or 0 where a team chooses nothing.
        """
        ...


class SkillTeam(eqx.Module):
    """Each agent's own selector picks one of the skills that all agents share (Algorithm 2)."""

    selectors: Selector
    """Leaves have a leading agent axis."""
    skills: Actor
    """Leaves have a leading skill axis."""

    def initial_memory(self) -> PyTree:
        return ()

    def act(
        self, observation: Float[Array, "agents obs"], memory: PyTree, key: Key[Array, ""]
    ) -> tuple[Float[Array, "agents act"], PyTree, Int[Array, " agents"]]:
        del key  # The best-scored skill is taken; nothing is drawn.
        choice = jax.vmap(Selector.__call__)(self.selectors, observation)
        return apply_skills(self.skills, observation, choice), memory, choice


class FixedChoiceTeam(eqx.Module):
    """All agents use one skill throughout: how well a skill does what it is trained for."""

    skill: Int[Array, ""]
    skills: Actor
    """Leaves have a leading skill axis."""
    n_agents: int = eqx.field(static=True)

    def initial_memory(self) -> PyTree:
        return ()

    def act(
        self, observation: Float[Array, "agents obs"], memory: PyTree, key: Key[Array, ""]
    ) -> tuple[Float[Array, "agents act"], PyTree, Int[Array, " agents"]]:
        del key
        choice = jnp.full(self.n_agents, self.skill, jnp.int32)
        return apply_skills(self.skills, observation, choice), memory, choice


def apply_skills(
    skills: Actor, observation: Float[Array, "agents obs"], choice: Int[Array, " agents"]
) -> Float[Array, "agents act"]:
    """Each agent's action by its chosen skill.

    Every skill is evaluated for every agent and the chosen one kept: a few small matrix products
    over the whole batch cost less than gathering each agent's own copy of the weights.
    """
    actions = jax.vmap(lambda skill: jax.vmap(skill)(observation))(skills)
    chosen = jax.nn.one_hot(choice, actions.shape[0], axis=0, dtype=actions.dtype)
    return (chosen[:, :, None] * actions).sum(0)
