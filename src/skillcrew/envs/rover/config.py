"""Every option of the Rover Domain, checked where it is written down."""

import dataclasses
import math
import string
from collections.abc import Mapping, Sequence
from typing import Any, Literal

from skillcrew.errors import UserError, unknown_name


@dataclasses.dataclass(frozen=True)
class RoverConfig:
    """A Rover Domain (thesis, section 4.1). Lengths are in metres, angles in radians unless said.

    Raises:
        UserError: a value out of range, or parents that cycle or name no type.
    """

    n_agents: int = 1
    """Rovers in the team."""
    n_poi_types: int = 2
    """Types of POI, called A, B, C, …; each must be observed once. At most 26."""
    pois_per_type: int = 1
    """POIs of each type; the first one observed counts for its type."""
    poi_values: tuple[float, ...] | None = None
    """Value V of a POI of each type in the sensor's sum V/δ² (eq. 4.2). Default: 1 for all."""
    spatial_coupling: int = 1
    """Rovers that must be within the activation distance of a POI in the same step."""
    parents: Mapping[str, tuple[str, ...]] | None = None
    """Types that must have been observed at an earlier step, per type. Default: the chain A, B, C…"""
    episode_length: int = 50
    """Steps until an unfinished episode is truncated."""
    world_size: float = 20.0
    """Side of the square."""
    bounded: bool = False
    """Stop rovers at the border of the square instead of letting them leave it."""
    max_turn: float = math.pi
    """Largest change of heading in a step (thesis: 180°)."""
    max_speed: float = 1.0
    """Largest drive in a step (thesis: 1 m/s)."""
    activation_distance: float = 2.0
    """Within this distance of a POI a rover counts towards observing it."""
    min_distance: float = 1.0
    """Lower bound of the sensed distance δ."""
    sensor: Literal["density", "closest"] = "density"
    """Sum over a sector's reflectors, or only its strongest (what is behind it is occluded)."""
    sensor_resolution: int = 90
    """Degrees per sector; divides 360."""
    observation_radius: float | None = None
    """Nothing farther than this is sensed. Default: no limit."""
    observed_pois: Literal["persist", "vanish"] = "persist"
    """Whether observed POIs stay in sensors and local rewards, or leave both."""
    team_reward: Literal["binary", "fraction"] = "binary"
    """1 when the last type is observed, or each newly observed type's share of all types."""

    def __post_init__(self) -> None:
        self._check_sizes()
        self._check_choices()
        if self.poi_values is not None:
            object.__setattr__(self, "poi_values", _checked_values(self.poi_values, self.n_poi_types))
        if self.parents is not None:
            object.__setattr__(self, "parents", _checked_parents(self.parents, self.type_names))

    @property
    def type_names(self) -> tuple[str, ...]:
        """A, B, …: one letter per type."""
        return tuple(string.ascii_uppercase[: self.n_poi_types])

    @property
    def values(self) -> tuple[float, ...]:
        """The POI value of each type."""
        return self.poi_values if self.poi_values is not None else (1.0,) * self.n_poi_types

    @property
    def parent_indices(self) -> tuple[tuple[int, ...], ...]:
        """For each type, the indices of the types that come before it."""
        names = self.type_names
        if self.parents is None:
            return tuple((index - 1,) if index else () for index in range(self.n_poi_types))
        return tuple(tuple(names.index(p) for p in self.parents.get(name, ())) for name in names)

    def _check_sizes(self) -> None:
        for field in ("n_agents", "n_poi_types", "pois_per_type", "spatial_coupling", "episode_length"):
            value = getattr(self, field)
            if isinstance(value, bool) or not isinstance(value, int) or value < 1:
                raise UserError(f"{field} = {value!r}: give a whole number of at least 1")
        for field in ("world_size", "max_turn", "max_speed", "activation_distance", "min_distance"):
            _check_positive(field, getattr(self, field))
        if self.observation_radius is not None:
            _check_positive("observation_radius", self.observation_radius)
        if self.n_poi_types > len(string.ascii_uppercase):
            raise UserError(f"n_poi_types = {self.n_poi_types}: at most {len(string.ascii_uppercase)} types")
        if self.spatial_coupling > self.n_agents:
            raise UserError(
                f"spatial_coupling = {self.spatial_coupling}: above the number of rovers, "
                f"n_agents = {self.n_agents}, so that no POI could ever be observed; "
                "lower spatial_coupling or raise n_agents"
            )
        resolution = self.sensor_resolution
        whole = isinstance(resolution, int) and not isinstance(resolution, bool)
        if not whole or resolution < 1 or 360 % resolution:
            raise UserError(
                f"sensor_resolution = {resolution!r}: give whole degrees that divide 360, such as 90"
            )

    def _check_choices(self) -> None:
        choices = {"sensor": ("density", "closest"), "observed_pois": ("persist", "vanish")}
        choices["team_reward"] = ("binary", "fraction")
        for field, valid in choices.items():
            if getattr(self, field) not in valid:
                raise unknown_name(field, str(getattr(self, field)), valid)
        if not isinstance(self.bounded, bool):
            raise UserError(f"bounded = {self.bounded!r}: give true or false")


def _check_positive(field: str, value: Any) -> None:
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value < math.inf:
        raise UserError(f"{field} = {value!r}: give a positive number")


def _checked_values(values: Any, n_poi_types: int) -> tuple[float, ...]:
    mend = f"poi_values = {values!r}: give {n_poi_types} positive numbers, one per POI type"
    if isinstance(values, str) or not isinstance(values, Sequence) or len(values) != n_poi_types:
        raise UserError(mend)
    for value in values:
        if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value < math.inf:
            raise UserError(mend)
    return tuple(float(value) for value in values)


def _checked_parents(parents: Any, names: tuple[str, ...]) -> dict[str, tuple[str, ...]]:
    if not isinstance(parents, Mapping):
        raise UserError(f"parents = {parents!r}: give a mapping from type to parents, such as {{'B': ['A']}}")
    for name, above in parents.items():
        if isinstance(above, str) or not isinstance(above, Sequence):
            raise UserError(
                f"parents = {parents!r}: give {name} a list of types, such as {{'{name}': ['A']}}"
            )
    graph = {name: tuple(above) for name, above in parents.items()}
    for name in [*graph, *(parent for above in graph.values() for parent in above)]:
        if name not in names:
            raise unknown_name("POI type in parents", str(name), names)
    settled: set[str] = set()
    while len(settled) < len(names):
        ready = [n for n in names if n not in settled and settled.issuperset(graph.get(n, ()))]
        if not ready:
            cycle = ", ".join(name for name in names if name not in settled)
            raise UserError(f"parents = {graph}: cycle among {cycle}; remove one of these parents")
        settled.update(ready)
    return graph
