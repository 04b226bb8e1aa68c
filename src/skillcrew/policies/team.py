"""What acts in an environment, whatever algorithm made it."""

from typing import Protocol, runtime_checkable

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, Key, PyTree

from skillcrew.envs.identified import identify
from skillcrew.envs.joint import join, part
from skillcrew.policies.actor import Actor
from skillcrew.policies.dispatch import apply_skills
from skillcrew.policies.memory import MemoryNetwork, for_each_agent, initial_memories
from skillcrew.policies.selector import AnySelector


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
    """Each agent's selector picks one of the skills that all agents share (Algorithm 2)."""

    selectors: AnySelector
    """Leaves have a leading axis: one selector for each agent, or a single one that all share."""
    skills: Actor
    """Leaves have a leading skill axis."""
    n_agents: int = eqx.field(static=True)

    def initial_memory(self) -> Float[Array, "agents units"]:
        return initial_memories(self.selectors, self.n_agents)

    def act(
        self, observation: Float[Array, "agents obs"], memory: PyTree, key: Key[Array, ""]
    ) -> tuple[Float[Array, "agents act"], PyTree, Int[Array, " agents"]]:
        del key  # The best-scored skill is taken; nothing is drawn.
        choice, memory = self.choose(observation, memory)
        return apply_skills(self.skills, observation, choice), memory, choice

    def choose(
        self, observation: Float[Array, "agents obs"], memory: Float[Array, "agents units"]
    ) -> tuple[Int[Array, " agents"], Float[Array, "agents units"]]:
        """Each agent's choice, and the new memory."""
        return for_each_agent(lambda selector, *seen: selector(*seen), self.selectors, observation, memory)


class ActorTeam(eqx.Module):
    """Each agent's network gives the primitive action itself; nothing is chosen."""

    actors: MemoryNetwork
    """Leaves have a leading axis: one actor for each agent, or a single one that all share."""
    n_agents: int = eqx.field(static=True)

    def initial_memory(self) -> Float[Array, "agents units"]:
        return initial_memories(self.actors, self.n_agents)

    def act(
        self, observation: Float[Array, "agents obs"], memory: PyTree, key: Key[Array, ""]
    ) -> tuple[Float[Array, "agents act"], PyTree, Int[Array, " agents"]]:
        del key
        outputs, memory = for_each_agent(MemoryNetwork.__call__, self.actors, observation, memory)
        return jnp.tanh(outputs), memory, jnp.zeros(self.n_agents, jnp.int32)


class JointTeam(eqx.Module):
    """A team of one, which sees and moves all agents, as the team of those agents."""

    team: Team
    n_agents: int = eqx.field(static=True)

    def initial_memory(self) -> PyTree:
        return self.team.initial_memory()

    def act(
        self, observation: Float[Array, "agents obs"], memory: PyTree, key: Key[Array, ""]
    ) -> tuple[Float[Array, "agents act"], PyTree, Int[Array, " agents"]]:
        action, memory, choice = self.team.act(join(observation), memory, key)
        return part(action, self.n_agents), memory, jnp.broadcast_to(choice, (self.n_agents,))


class IdentifiedTeam(eqx.Module):
    """A team whose agents are told which of them they are, as a team that is not told."""

    team: Team

    def initial_memory(self) -> PyTree:
        return self.team.initial_memory()

    def act(
        self, observation: Float[Array, "agents obs"], memory: PyTree, key: Key[Array, ""]
    ) -> tuple[Float[Array, "agents act"], PyTree, Int[Array, " agents"]]:
        return self.team.act(identify(observation), memory, key)


class NoisyTeam(eqx.Module):
    """A team that explores: Gaussian noise on every action, which is then clipped to [-1, 1]."""

    team: Team
    deviation: float = eqx.field(static=True)

    def initial_memory(self) -> PyTree:
        return self.team.initial_memory()

    def act(
        self, observation: Float[Array, "agents obs"], memory: PyTree, key: Key[Array, ""]
    ) -> tuple[Float[Array, "agents act"], PyTree, Int[Array, " agents"]]:
        key_team, key_noise = jax.random.split(key)
        action, memory, choice = self.team.act(observation, memory, key_team)
        noise = self.deviation * jax.random.normal(key_noise, action.shape)
        return jnp.clip(action + noise, -1.0, 1.0), memory, choice


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
        used = jax.tree.map(lambda leaf: leaf[self.skill], self.skills)
        return jax.vmap(used)(observation), memory, jnp.full(self.n_agents, self.skill, jnp.int32)


class WanderingTeam(eqx.Module):
    """Agents choose skills at random while they explore, and by their selectors after that (MFL).

    A random choice is kept for a while: one drawn anew at every step leads nowhere.
    """

    team: SkillTeam
    exploring: Bool[Array, ""]
    change: float = eqx.field(static=True)
    """Probability per step that an exploring agent draws a skill anew."""

    def initial_memory(self) -> tuple[PyTree, Int[Array, " agents"]]:
        """The selectors' memory, and the skill that each agent explores by; -1 for none yet."""
        return self.team.initial_memory(), jnp.full(self.team.n_agents, -1, jnp.int32)

    def act(
        self, observation: Float[Array, "agents obs"], memory: PyTree, key: Key[Array, ""]
    ) -> tuple[Float[Array, "agents act"], PyTree, Int[Array, " agents"]]:
        chosen, own_memory = self.team.choose(observation, memory[0])
        wandered = self._wander(memory[1], key)
        choice = jnp.where(self.exploring, wandered, chosen)
        return apply_skills(self.team.skills, observation, choice), (own_memory, wandered), choice

    def _wander(self, last: Int[Array, " agents"], key: Key[Array, ""]) -> Int[Array, " agents"]:
        n_skills = jax.tree.leaves(self.team.skills)[0].shape[0]
        changes, drawn = jax.random.uniform(key, (2, *last.shape))
        another = jnp.floor(drawn * n_skills).astype(jnp.int32)
        return jnp.where((last < 0) | (changes < self.change), another, last)
