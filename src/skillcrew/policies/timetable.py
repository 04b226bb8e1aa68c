"""Selectors that commit: an episode in phases, one skill in each, and a network that may intervene.

A timetable is an open-loop plan: a sequence of options with fixed durations (Sutton, Precup and Singh 1999),
so that choices are made once a phase and not once a step. A reactive one adds closed-loop terminations and
interruptions: its network sees what the agent senses, and may end a phase early or choose another skill.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, Key

from skillcrew.policies.memory import MemoryNetwork, PolicyConfig


class Timetable(eqx.Module):
    """Which skill an agent follows in each phase of an episode, and how long each phase is."""

    scores: Float[Array, "phases skills"]
    """A phase's skill is the one with the highest score."""
    lengths: Float[Array, " phases"]
    """In units of an equal share of the episode; a phase of no or negative length is left out."""

    @classmethod
    def create(cls, key: Key[Array, ""], phases: int, n_skills: int) -> "Timetable":
        """Draws a timetable: any skills, equal lengths.

        How often the skill changes from one phase to the next is drawn first, uniformly between never and
        always: few long stretches are as likely as many short ones.
        """
        key_scores, key_often, key_changes = jax.random.split(key, 3)
        scores = jax.random.normal(key_scores, (phases, n_skills))
        changes = jax.random.uniform(key_changes, (phases,)) < jax.random.uniform(key_often)
        begun = jax.lax.cummax(jnp.where(changes, jnp.arange(phases), 0))
        return cls(scores[begun], jnp.ones(phases))

    @property
    def n_skills(self) -> int:
        return self.scores.shape[-1]

    def skills(self) -> Int[Array, " phases"]:
        """The index of each phase's skill."""
        return jnp.argmax(self.scores, axis=-1).astype(jnp.int32)

    def ends(self, episode_length: int) -> Float[Array, " phases"]:
        """The step, counted from 0, at which each phase is over, in whole steps.

        The last phase has no end: it lasts for as long as the episode does.
        """
        share = episode_length / self.lengths.shape[-1]
        ends = jnp.round(jnp.cumsum(jnp.maximum(self.lengths, 0.0)) * share)
        return ends.at[-1].set(jnp.inf)


class TimetableSelector(eqx.Module):
    """From an agent's own count of steps, and with a network from what it senses, to the index of a skill.

    What is remembered is the clock and the network's memory. The clock advances by one each step; the network
    may set it forward to the end of the present phase, so that all later ones begin earlier.
    """

    timetable: Timetable
    network: MemoryNetwork | None
    """Outputs: for each skill what is added to its score, where the timetable's skill has 1 and the others 0;
    then, for each skill, by what the phase is ended when the timetable has it there: if above 1."""
    episode_length: int = eqx.field(static=True)

    @classmethod
    def create(
        cls,
        key: Key[Array, ""],
        observation_size: int,
        n_skills: int,
        episode_length: int,
        phases: int,
        reactive: PolicyConfig | None,
    ) -> "TimetableSelector":
        """Draws a timetable, and a network whose outputs are all 0: it begins by leaving the timetable alone.

        Args:
            reactive: the network's size; None for a timetable alone.
        """
        key_timetable, key_network = jax.random.split(key)
        timetable = Timetable.create(key_timetable, phases, n_skills)
        network = None
        if reactive:
            network = MemoryNetwork.create(key_network, observation_size, 2 * n_skills, reactive).silent()
        return cls(timetable, network, episode_length)

    def initial_memory(self) -> Float[Array, " memory"]:
        """The clock at 0, and nothing remembered."""
        if self.network is None:
            return jnp.zeros(1)
        return jnp.concatenate([jnp.zeros(1), self.network.initial_memory()])

    def __call__(
        self, observation: Float[Array, " obs"], memory: Float[Array, " memory"]
    ) -> tuple[Int[Array, ""], Float[Array, " memory"]]:
        """The chosen skill, and the new memory."""
        clock, remembered = memory[0], memory[1:]
        skills, ends = self.timetable.skills(), self.timetable.ends(self.episode_length)
        if self.network is None:
            return _at(skills, clock >= ends), memory + 1
        outputs, remembered = self.network(observation, remembered)
        interventions, terminations = jnp.split(outputs, 2)
        planned = _one_hot(_at(skills, clock >= ends), len(interventions))
        over = (planned * terminations).sum() > 1
        # The end of the present phase: the first that is still to come. The last phase has none.
        end = jnp.where(clock < ends, ends, jnp.inf).min()
        clock = jnp.where(over & jnp.isfinite(end), end, clock)
        planned = _one_hot(_at(skills, clock >= ends), len(interventions))
        choice = jnp.argmax(planned + interventions).astype(jnp.int32)
        return choice, jnp.concatenate([clock[None] + 1, remembered])


def _at(skills: Int[Array, " phases"], over: Array) -> Int[Array, ""]:
    """The skill of the first phase that is not over."""
    phase = over.sum()
    return jnp.where(jnp.arange(len(skills)) == phase, skills, 0).sum()


def _one_hot(skill: Int[Array, ""], n_skills: int) -> Float[Array, " skills"]:
    return (jnp.arange(n_skills) == skill).astype(jnp.float32)
