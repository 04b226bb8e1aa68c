"""Every option of the Rover Domain, checked where it is written down."""

import dataclasses
import math
import string
from collections.abc import Mapping, Sequence
from typing import Any, Literal

from skillcrew.envs.rover.order import (
    Graph,
    chain,
    checked_groups,
    checked_parents,
    sorted_by_parents,
    waiting_forever,
    with_singles,
)
from skillcrew.errors import UserError, unknown_name


@dataclasses.dataclass(frozen=True)
class RoverConfig:
    """A Rover Domain (thesis, section 4.1). Lengths are in metres, angles in radians unless said.

    Raises:
        UserError: a value out of range, types that wait for one another or do not exist, or options that
            exclude one another.
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
    simultaneous: tuple[tuple[str, ...], ...] | None = ()
    """Groups of types that count only when all types of the group are observed in the same step.
    The default chain then goes from group to group, in the order of their first types."""
    order: Literal["fixed", "drawn"] = "fixed"
    """"drawn": each episode draws in which order the types must be observed, and only sensors tell it: the
    next type calls. Every rover hears it, as one more reading per type: 1 for the type that calls, else 0."""
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
    poi_speed: float = 0.0
    """POIs move so far in each step, each straight on in a direction of its own until the border throws it
    back; at most `world_size`."""
    breakdowns: int = 0
    """Rovers that break down in each episode, each at a step of its own, any as likely: from then on it
    stands still, does not count, and is neither sensed nor approached. Its own sensors go on."""
    team_reward: Literal["binary", "fraction"] = "binary"
    """1 when the last type is observed, or each newly observed type's share of all types."""

    def __post_init__(self) -> None:
        self._check_sizes()
        self._check_choices()
        if self.poi_values is not None:
            object.__setattr__(self, "poi_values", _checked_values(self.poi_values, self.n_poi_types))
        if self.parents is not None:
            object.__setattr__(self, "parents", checked_parents(self.parents, self.type_names))
        groups = () if self.simultaneous is None else checked_groups(self.simultaneous, self.type_names)
        object.__setattr__(self, "simultaneous", groups)
        self._check_order()
        self._check_rovers_suffice()

    @property
    def type_names(self) -> tuple[str, ...]:
        """A, B, …: one letter per type."""
        return tuple(string.ascii_uppercase[: self.n_poi_types])

    @property
    def skills(self) -> tuple[str, ...]:
        """`go_to_X` and `go_away_from_X` for each POI type and, in a team, for the closest agent.

        The order is that of the local rewards (thesis, section 4.4.2).
        """
        targets = [f"poi_{name}" for name in self.type_names] + ["agent"] * (self.n_agents > 1)
        return tuple(f"{verb}_{target}" for target in targets for verb in ("go_to", "go_away_from"))

    def summary(self) -> str:
        """One line on sizes, and on what it has beyond them."""
        groups = " then ".join("+".join(group) for group in self.simultaneous or ())
        said = {
            f"{groups} at once": self.simultaneous,
            "order drawn": self.order == "drawn",
            "POIs move": self.poi_speed,
            f"{self.breakdowns} breaks down": self.breakdowns,
        }
        sizes = (
            f"{self.n_agents} rover(s), {self.n_poi_types} POI types, spatial coupling "
            f"{self.spatial_coupling}, {self.episode_length} steps"
        )
        return sizes + "".join(f", {what}" for what, holds in said.items() if holds)

    @property
    def values(self) -> tuple[float, ...]:
        """The POI value of each type."""
        return self.poi_values if self.poi_values is not None else (1.0,) * self.n_poi_types

    @property
    def n_pois(self) -> int:
        """POIs of all types together."""
        return self.n_poi_types * self.pois_per_type

    @property
    def parent_indices(self) -> tuple[tuple[int, ...], ...]:
        """For each type, the indices of the types that come before it, unless the order is drawn."""
        return tuple(self._indices(self._graph.get(name, ())) for name in self.type_names)

    @property
    def group_indices(self) -> tuple[tuple[int, ...], ...]:
        """The types by what is observed at once, most by themselves, in an order in which they can be."""
        groups = with_singles(self.simultaneous or (), self.type_names)
        return tuple(self._indices(group) for group in sorted_by_parents(groups, self._graph))

    @property
    def rovers_at_once(self) -> int:
        """How many rovers the largest group takes."""
        return self.spatial_coupling * max(len(group) for group in self.group_indices)

    @property
    def _graph(self) -> Graph:
        if self.parents is not None:
            return self.parents
        return chain(with_singles(self.simultaneous or (), self.type_names))

    def _indices(self, names: Sequence[str]) -> tuple[int, ...]:
        return tuple(self.type_names.index(name) for name in names)

    def _check_sizes(self) -> None:
        for field in ("n_agents", "n_poi_types", "pois_per_type", "spatial_coupling", "episode_length"):
            value = getattr(self, field)
            if isinstance(value, bool) or not isinstance(value, int) or value < 1:
                raise UserError(f"{field} = {value!r}: give a whole number of at least 1")
        for field in ("world_size", "max_turn", "max_speed", "activation_distance", "min_distance"):
            _check_positive(field, getattr(self, field))
        _check_speed("poi_speed", self.poi_speed, self.world_size)
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
        choices |= {"team_reward": ("binary", "fraction"), "order": ("fixed", "drawn")}
        for field, valid in choices.items():
            if getattr(self, field) not in valid:
                raise unknown_name(field, str(getattr(self, field)), valid)
        if not isinstance(self.bounded, bool):
            raise UserError(f"bounded = {self.bounded!r}: give true or false")

    def _check_order(self) -> None:
        if self.order == "drawn":
            for field in ("parents", "simultaneous"):
                if getattr(self, field) not in (None, ()):
                    raise UserError(f"order = 'drawn': each episode draws its own chain; leave out {field}")
        groups = with_singles(self.simultaneous or (), self.type_names)
        if waiting := waiting_forever(groups, self._graph):
            raise UserError(
                f"simultaneous = {self.simultaneous}: {waiting} would wait for one another, with parents = "
                f"{self.parents}; types of a group must not come before one another"
            )

    def _check_rovers_suffice(self) -> None:
        needed = self.rovers_at_once
        if needed > self.n_agents:
            raise UserError(
                f"simultaneous = {self.simultaneous}: the largest group takes {needed} rovers at once, "
                f"above n_agents = {self.n_agents}; lower spatial_coupling or raise n_agents"
            )
        broken, spare = self.breakdowns, self.n_agents - needed
        if isinstance(broken, bool) or not isinstance(broken, int) or broken < 0:
            raise UserError(f"breakdowns = {broken!r}: give a whole number of at least 0")
        if broken > spare:
            raise UserError(
                f"breakdowns = {broken}: no rover to spare, since {needed} of n_agents = {self.n_agents} are "
                f"needed at once; give at most {spare}"
            )


def _check_positive(field: str, value: Any) -> None:
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value < math.inf:
        raise UserError(f"{field} = {value!r}: give a positive number")


def _check_speed(field: str, value: Any, most: float) -> None:
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value <= most:
        raise UserError(f"{field} = {value!r}: give a number from 0 to world_size = {most}")


def _checked_values(values: Any, n_poi_types: int) -> tuple[float, ...]:
    mend = f"poi_values = {values!r}: give {n_poi_types} positive numbers, one per POI type"
    if isinstance(values, str) or not isinstance(values, Sequence) or len(values) != n_poi_types:
        raise UserError(mend)
    for value in values:
        if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value < math.inf:
            raise UserError(mend)
    return tuple(float(value) for value in values)
