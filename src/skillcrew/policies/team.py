"""What acts in an environment, whatever algorithm made it."""

from typing import Protocol, runtime_checkable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int, Key, PyTree

from skillcrew.envs.identified import identify
from skillcrew.envs.joint import join, part
from skillcrew.policies.action_values import ActionValues, best_action
from skillcrew.policies.dispatch import Skills, apply_skills
from skillcrew.policies.exploration import with_noise, with_random_ones
from skillcrew.policies.memory import MemoryNetwork, for_each_agent, initial_memories
from skillcrew.policies.selector import AnySelector

Action = Float[Array, "agents act"] | Int[Array, " decisions"]
"""Numbers in [-1, 1] for each agent, or the index of each agent's discrete action."""


@runtime_checkable
class Team(Protocol):
    """A pytree that acts for all agents of one world; scoring and reports know no more than this."""

    def initial_memory(self) -> PyTree:
        """What the team remembers at the start of an episode."""
        ...

    def act(
        self, observation: Float[Array, "agents obs"], memory: PyTree, key: Key[Array, ""]
    ) -> tuple[Action, PyTree, Int[Array, " agents"]]:
        """Each agent's primitive action, the new memory, and each agent's choice.

        The choice is the index of the chosen skill, or 0 where a team chooses nothing.
        """
        ...


class SkillTeam(eqx.Module):
    """Each agent's selector picks one of the skills that all agents share (Algorithm 2)."""

    selectors: AnySelector
    """Leaves have a leading axis: one selector for each agent, or a single one that all share."""
    skills: Skills
    n_agents: int = eqx.field(static=True)
    repertoire: tuple[tuple[int, ...], ...] = eqx.field(static=True, default=())
    """Where agents differ, the skill that each agent's each choice stands for."""

    def initial_memory(self) -> Float[Array, "agents units"]:
        return initial_memories(self.selectors, self.n_agents)

    def act(
        self, observation: Float[Array, "agents obs"], memory: PyTree, key: Key[Array, ""]
    ) -> tuple[Action, PyTree, Int[Array, " agents"]]:
        del key  # The best-scored skill is taken; nothing is drawn.
        choice, memory = self.choose(observation, memory)
        return act_by_skills(self.skills, observation, choice), memory, choice

    def choose(
        self, observation: Float[Array, "agents obs"], memory: Float[Array, "agents units"]
    ) -> tuple[Int[Array, " agents"], Float[Array, "agents units"]]:
        """Each agent's choice, as the index of a skill, and the new memory."""
        choice, memory = for_each_agent(
            lambda selector, *seen: selector(*seen), self.selectors, observation, memory
        )
        return self.as_skills(choice), memory

    def as_skills(self, choice: Int[Array, " agents"]) -> Int[Array, " agents"]:
        """The index of the skill that each agent's choice stands for."""
        if not self.repertoire:
            return choice
        return jnp.asarray(self.repertoire, jnp.int32)[np.arange(self.n_agents), choice]


class ActorTeam(eqx.Module):
    """Each agent's network gives the primitive action itself; nothing is chosen."""

    actors: MemoryNetwork
    """Leaves have a leading axis: one actor for each agent, or a single one that all share."""
    n_agents: int = eqx.field(static=True)
    choices: int = eqx.field(static=True, default=0)
    """Discrete actions that each decision is made among, by the highest output; 0 for continuous actions."""

    def initial_memory(self) -> Float[Array, "agents units"]:
        return initial_memories(self.actors, self.n_agents)

    def act(
        self, observation: Float[Array, "agents obs"], memory: PyTree, key: Key[Array, ""]
    ) -> tuple[Action, PyTree, Int[Array, " agents"]]:
        del key
        outputs, memory = for_each_agent(MemoryNetwork.__call__, self.actors, observation, memory)
        action = best_action(outputs, self.choices) if self.choices else jnp.tanh(outputs)
        return action, memory, jnp.zeros(self.n_agents, jnp.int32)


class JointTeam(eqx.Module):
    """A team of one, which sees and moves all agents, as the team of those agents."""

    team: Team
    n_agents: int = eqx.field(static=True)

    def initial_memory(self) -> PyTree:
        return self.team.initial_memory()

    def act(
        self, observation: Float[Array, "agents obs"], memory: PyTree, key: Key[Array, ""]
    ) -> tuple[Action, PyTree, Int[Array, " agents"]]:
        action, memory, choice = self.team.act(join(observation), memory, key)
        if jnp.issubdtype(action.dtype, jnp.floating):
            action = part(action, self.n_agents)
        return action, memory, jnp.broadcast_to(choice, (self.n_agents,))


class IdentifiedTeam(eqx.Module):
    """A team whose agents are told which of them they are, as a team that is not told."""

    team: Team

    def initial_memory(self) -> PyTree:
        return self.team.initial_memory()

    def act(
        self, observation: Float[Array, "agents obs"], memory: PyTree, key: Key[Array, ""]
    ) -> tuple[Action, PyTree, Int[Array, " agents"]]:
        return self.team.act(identify(observation), memory, key)


class NoisyTeam(eqx.Module):
    """A team that explores: Gaussian noise on every action, or now and then a random discrete one."""

    team: Team
    noise: float = eqx.field(static=True)
    """The standard deviation, or how likely each discrete action is a random one."""
    choices: int = eqx.field(static=True, default=0)
    """Discrete actions that each decision is made among; 0 for continuous actions."""

    def initial_memory(self) -> PyTree:
        return self.team.initial_memory()

    def act(
        self, observation: Float[Array, "agents obs"], memory: PyTree, key: Key[Array, ""]
    ) -> tuple[Action, PyTree, Int[Array, " agents"]]:
        key_team, key_noise = jax.random.split(key)
        action, memory, choice = self.team.act(observation, memory, key_team)
        if self.choices:
            action = with_random_ones(key_noise, action, self.noise, self.choices)
        else:
            action = with_noise(key_noise, action, self.noise)
        return action, memory, choice


class FixedChoiceTeam(eqx.Module):
    """All agents use one skill throughout: how well a skill does what it is trained for."""

    skill: Int[Array, ""]
    skills: Skills
    n_agents: int = eqx.field(static=True)
    partners: tuple[tuple[int, ...], ...] = eqx.field(static=True, default=())
    """Where agents differ, for each skill what each agent uses: those of other types one of their own."""

    def initial_memory(self) -> PyTree:
        return ()

    def act(
        self, observation: Float[Array, "agents obs"], memory: PyTree, key: Key[Array, ""]
    ) -> tuple[Action, PyTree, Int[Array, " agents"]]:
        del key
        if self.partners:
            choice = jnp.asarray(self.partners, jnp.int32)[self.skill]
            return act_by_skills(self.skills, observation, choice), memory, choice
        used = jax.tree.map(lambda leaf: leaf[self.skill], self.skills)
        action = _as_action(self.skills, jax.vmap(used)(observation))
        return action, memory, jnp.full(self.n_agents, self.skill, jnp.int32)


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
    ) -> tuple[Action, PyTree, Int[Array, " agents"]]:
        chosen, own_memory = self.team.choose(observation, memory[0])
        wandered = self._wander(memory[1], key)
        choice = jnp.where(self.exploring, wandered, chosen)
        return act_by_skills(self.team.skills, observation, choice), (own_memory, wandered), choice

    def _wander(self, last: Int[Array, " agents"], key: Key[Array, ""]) -> Int[Array, " agents"]:
        repertoire = self.team.repertoire
        n_choices = len(repertoire[0]) if repertoire else jax.tree.leaves(self.team.skills)[0].shape[0]
        changes, drawn = jax.random.uniform(key, (2, *last.shape))
        another = self.team.as_skills(jnp.floor(drawn * n_choices).astype(jnp.int32))
        return jnp.where((last < 0) | (changes < self.change), another, last)


def act_by_skills(
    skills: Skills, observation: Float[Array, "agents obs"], choice: Int[Array, " agents"]
) -> Action:
    """Each agent's action by the skill of that index."""
    return _as_action(skills, apply_skills(skills, observation, choice))


def _as_action(skills: Skills, outputs: Float[Array, "agents act"]) -> Action:
    """What skills do, of what they say: an actor says it, of values the best is taken."""
    return best_action(outputs, skills.action_size) if isinstance(skills, ActionValues) else outputs
