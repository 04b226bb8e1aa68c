"""Policies over skills."""

import dataclasses

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, Key

from skillcrew.errors import UserError
from skillcrew.policies.holding import hold
from skillcrew.policies.memory import MemoryNetwork, PolicyConfig
from skillcrew.policies.timetable import TimetableSelector


@dataclasses.dataclass(frozen=True)
class SelectorConfig(PolicyConfig):
    """A selector: a network that decides at every step, or a timetable that commits."""

    phases: int = 0
    """Phases of a timetable, each with one skill to follow; 0 for none: the network decides alone."""
    reactive: bool = False
    """With phases: whether the network may end a phase early or choose another skill. It begins silent."""
    alike: float = 0.0
    """Probability that the agents of a random team begin with one and the same selector, where each has its
    own; if not, that there are two different ones among them, and so on. 0: each begins with another."""
    hold: int = 1
    """Least number of steps for which a choice is kept; 1 decides anew at every step."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.phases < 0:
            raise UserError(
                f"selector.phases = {self.phases}: give a number of phases, or 0 for no timetable"
            )
        if self.reactive and not self.phases:
            raise UserError(
                "selector.reactive = True: there is no timetable to react on; set selector.phases to at "
                "least 1"
            )
        if not 0 <= self.alike <= 1:
            raise UserError(f"selector.alike = {self.alike}: give a probability between 0 and 1")
        if self.hold < 1:
            raise UserError(f"selector.hold = {self.hold}: give at least 1 step")

    @classmethod
    def of(cls, policy: PolicyConfig) -> "SelectorConfig":
        """A selector that decides at every step, by such a network; a `SelectorConfig` stays what it is."""
        return policy if isinstance(policy, cls) else cls(**dataclasses.asdict(policy))

    def check_episode(self, episode_length: int) -> None:
        """Raises `UserError` if an episode of so many steps has no room for the phases."""
        if self.phases > episode_length:
            raise UserError(
                f"selector.phases = {self.phases}: an episode has {episode_length} steps, and a phase at "
                f"least one; give at most {episode_length}"
            )


class Selector(eqx.Module):
    """From one agent's observation to the index of a skill (π, eq. 3.5): the highest score wins."""

    network: MemoryNetwork

    @classmethod
    def create(
        cls, key: Key[Array, ""], observation_size: int, n_skills: int, config: PolicyConfig
    ) -> "Selector":
        return cls(MemoryNetwork.create(key, observation_size, n_skills, config))

    def initial_memory(self) -> Float[Array, " units"]:
        return self.network.initial_memory()

    def __call__(
        self, observation: Float[Array, " obs"], memory: Float[Array, " units"]
    ) -> tuple[Int[Array, ""], Float[Array, " units"]]:
        """The chosen skill, and the new memory."""
        scores, memory = self.network(observation, memory)
        return jnp.argmax(scores).astype(jnp.int32), memory


class HoldingSelector(eqx.Module):
    """Another selector's choices, each kept for a number of steps; what it remembers goes on meanwhile."""

    selector: Selector | TimetableSelector
    steps: int = eqx.field(static=True)

    def initial_memory(self) -> Float[Array, " memory"]:
        """Steps for which the choice is kept yet, the choice (none), and what the selector remembers."""
        return jnp.concatenate([jnp.array([0.0, -1.0]), self.selector.initial_memory()])

    def __call__(
        self, observation: Float[Array, " obs"], memory: Float[Array, " memory"]
    ) -> tuple[Int[Array, ""], Float[Array, " memory"]]:
        """The kept or new choice, and the new memory."""
        left, kept = memory[0], memory[1]
        wanted, remembered = self.selector(observation, memory[2:])
        choice, left = hold(left, kept, wanted.astype(jnp.float32), self.steps)
        return choice.astype(jnp.int32), jnp.concatenate([left[None], choice[None], remembered])


AnySelector = Selector | TimetableSelector | HoldingSelector


def create_selector(
    key: Key[Array, ""], observation_size: int, n_skills: int, episode_length: int, config: SelectorConfig
) -> AnySelector:
    """Draws a selector of the configured kind."""
    if config.phases:
        selector = TimetableSelector.create(
            key,
            observation_size,
            n_skills,
            episode_length,
            config.phases,
            config if config.reactive else None,
        )
    else:
        selector = Selector.create(key, observation_size, n_skills, config)
    return HoldingSelector(selector, config.hold) if config.hold > 1 else selector
