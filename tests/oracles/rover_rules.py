"""What the oracle of the Rover Domain works on: its rules, a state, and what a step returns."""

import dataclasses
import functools

import numpy as np


@dataclasses.dataclass(frozen=True)
class Kind:
    """What rovers of one type can do, where they differ."""

    name: str
    rovers: int
    coupling: int
    """How many of them a POI takes."""
    max_turn: float
    max_speed: float
    n_sectors: int
    radius: float | None


@dataclasses.dataclass(frozen=True)
class World:
    """The rules of one Rover Domain."""

    n_agents: int
    poi_types: tuple[int, ...]
    """The type of each POI, as an index."""
    poi_values: tuple[float, ...]
    """The value of each POI, V in equation 4.2."""
    coupling: int
    parents: tuple[tuple[int, ...], ...]
    """For each type, the types to be observed before it."""
    episode_length: int
    world_size: float
    bounded: bool
    max_turn: float
    max_speed: float
    activation_distance: float
    min_distance: float
    closest_only: bool
    """Whether a sector returns its strongest reflector alone, instead of the sum."""
    n_sectors: int
    radius: float | None
    """How far a rover senses; None for no limit."""
    vanish: bool
    """Whether observed POIs leave the world."""
    team_reward: str
    """"binary", "fraction", "value" or "closest"."""
    groups: tuple[tuple[int, ...], ...] = ()
    """Types that only count together."""
    order_drawn: bool = False
    poi_speed: float = 0.0
    breakdowns: int = 0
    """How many rovers break down in an episode."""
    kinds: tuple[Kind, ...] = ()
    """Empty where rovers are alike. The first rovers are of the first kind."""

    def kind_of(self, agent: int) -> int:
        return self._kinds_of_rovers[agent]

    def of(self, agent: int) -> "World":
        """The rules as they are for one rover."""
        return self._of_kinds[self.kind_of(agent)] if self.kinds else self

    # Kept, since every step asks for them many times.
    @functools.cached_property
    def _kinds_of_rovers(self) -> list[int]:
        return [place for place, kind in enumerate(self.kinds) for _ in range(kind.rovers)]

    @functools.cached_property
    def _of_kinds(self) -> list["World"]:
        fields = ("max_turn", "max_speed", "n_sectors", "radius")
        return [
            dataclasses.replace(self, **{field: getattr(kind, field) for field in fields})
            for kind in self.kinds
        ]

    @property
    def n_types(self) -> int:
        return len(self.parents)

    @property
    def n_pois(self) -> int:
        return len(self.poi_types)


@dataclasses.dataclass
class State:
    """Where everything is; float64 arrays."""

    position: np.ndarray
    heading: np.ndarray
    poi_position: np.ndarray
    observed: np.ndarray
    time: int
    poi_direction: np.ndarray | None = None
    """A vector of length 1 for each POI, where POIs move."""
    order: np.ndarray | None = None
    """Each type's place, where the order is drawn."""
    breaks_at: np.ndarray | None = None
    """The step from which on each rover is broken, where rovers break down."""
    best: np.ndarray | None = None
    """For each POI value over distance of the best visit so far, 0 before the first, where that is paid."""


@dataclasses.dataclass
class Outcome:
    """What one step returns beside the new state."""

    observation: np.ndarray
    local_rewards: dict[str, np.ndarray]
    """Per skill's name, one reward per agent."""
    team_reward: float
    terminated: bool
    truncated: bool
