"""One world on the host, as the bridges into JAX see it: all agents' numbers in a row."""

import dataclasses
import re
from collections.abc import Callable, Iterable, Sequence
from typing import Literal, NamedTuple, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float, Int

Actions = Float[np.ndarray, " numbers"] | Int[np.ndarray, " numbers"]


@dataclasses.dataclass(frozen=True)
class Agent:
    """What an agent sees and does."""

    name: str
    observation_size: int
    action_size: int
    """Numbers per action; with discrete actions, how many there are."""
    actions: Literal["continuous", "discrete"]

    @property
    def numbers(self) -> int:
        """How many numbers say what it does."""
        return self.action_size if self.actions == "continuous" else 1


class Moved(NamedTuple):
    """What a step brings."""

    observation: Float[np.ndarray, " numbers"]
    """Of all agents in a row; of one that is gone, what it saw last."""
    rewards: Float[np.ndarray, " agents"]
    """Of one that is gone, 0."""
    terminated: bool
    """The episode is over for all of them, and for none because it was cut off."""
    truncated: bool
    """The episode is over, and for some of them because it was cut off."""


@runtime_checkable
class HostWorld(Protocol):
    """What changes lives in it. It has to be deterministic, given the seed and the actions."""

    @property
    def agents(self) -> Sequence[Agent]:
        """In the order of their numbers, kind by kind."""
        ...

    @property
    def max_steps(self) -> int | None:
        """When the world itself cuts its episodes off, if it says so."""
        ...

    def reset(self, seed: int) -> Float[np.ndarray, " numbers"]:
        """Begins anew, whatever was before; returns what all agents see, in a row."""
        ...

    def step(self, action: Actions) -> Moved:
        """Moves all agents: actions in [-1, 1], or indices."""
        ...


def by_kind(agents: Iterable[Agent]) -> dict[str, list[Agent]]:
    """Agents that see and do as much as each other, by a name for each such kind.

    The name is what the agents' own names begin with, or that of the first of them where that would not
    tell kinds apart.
    """
    kinds: dict[tuple[int, int], list[Agent]] = {}
    for agent in agents:
        kinds.setdefault((agent.observation_size, agent.action_size), []).append(agent)
    stems = [{re.sub(r"_?\d+$", "", agent.name) or agent.name for agent in kind} for kind in kinds.values()]
    named = [stem for kind in stems for stem in kind]
    is_told_apart = len(named) == len(set(named)) == len(kinds)
    return {
        (min(stem) if is_told_apart else kind[0].name).replace("/", "-"): kind
        for stem, kind in zip(stems, kinds.values(), strict=True)
    }


MakeWorld = Callable[[], HostWorld]
