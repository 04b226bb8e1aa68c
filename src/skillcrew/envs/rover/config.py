"""Every option of the Rover Domain, checked where it is written down."""

import dataclasses
import math
import string
from collections.abc import Mapping, Sequence
from typing import Literal, get_args

from skillcrew.envs.rover.checks import (
    check_count,
    check_positive,
    check_resolution,
    check_speed,
    checked_values,
)
from skillcrew.envs.rover.crew import RoverType, checked_crew
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

OF_A_TYPE = ("spatial_coupling", "max_turn", "max_speed", "sensor_resolution", "observation_radius")
"""What each of `rover_types` says of itself."""
TeamReward = Literal["binary", "fraction", "value", "closest"]
"""What the team is paid for; see `RoverConfig.team_reward`."""


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
    """Value V of a POI of each type, in the sensor's sum V/δ² (eq. 4.2) and in the team's dense rewards.
    Default: 1 for all."""
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
    """Lower bound of the sensed distance δ, and of the distance that the team reward "closest" pays for."""
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
    rover_types: tuple[RoverType, ...] | None = ()
    """Rovers that differ. A POI then takes `coupling` of each type in the same step; what a type says of
    itself is left out above, and `n_agents` follows. Default: all rovers are alike."""
    team_reward: TeamReward = "binary"
    """"binary": 1 with the last type. "fraction": each new type's share of all. "value": each new POI's share
    of the value of all. "closest": value over distance of each POI's closest visit, as it grows."""

    def __post_init__(self) -> None:
        crew = checked_crew(self.rover_types or ())
        object.__setattr__(self, "rover_types", crew)
        if crew:
            self._take_rovers_of_types(crew)
        self._check_sizes()
        self._check_choices()
        if self.poi_values is not None:
            object.__setattr__(self, "poi_values", checked_values(self.poi_values, self.n_poi_types))
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

    @property
    def crew(self) -> tuple[RoverType, ...]:
        """The types of rovers; a single one where all are alike."""
        if self.rover_types:
            return self.rover_types
        alike = RoverType(
            "rover",
            self.n_agents,
            self.spatial_coupling,
            self.max_turn,
            self.max_speed,
            self.observation_radius,
            self.sensor_resolution,
        )
        return (alike,)

    def summary(self) -> str:
        """One line on sizes, and on what it has beyond them."""
        groups = " then ".join("+".join(group) for group in self.simultaneous or ())
        said = {
            f"{self.pois_per_type} POIs of each": self.pois_per_type > 1,
            f"{groups} at once": self.simultaneous,
            "order drawn": self.order == "drawn",
            "POIs move": self.poi_speed,
            f"{self.breakdowns} breaks down": self.breakdowns,
            "value observed is paid": self.team_reward == "value",
            "closest visits are paid": self.team_reward == "closest",
        }
        rovers, coupling = f"{self.n_agents} rover(s)", str(self.spatial_coupling)
        if self.rover_types:
            rovers = " + ".join(f"{kind.rovers} {kind.name}" for kind in self.rover_types)
            coupling = " + ".join(f"{kind.coupling} {kind.name}" for kind in self.rover_types)
        sizes = (
            f"{rovers}, {self.n_poi_types} POI types, spatial coupling {coupling}, "
            f"{self.episode_length} steps"
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
    def largest_group(self) -> int:
        """How many types are observed at once at most."""
        return max(len(group) for group in self.group_indices)

    @property
    def _graph(self) -> Graph:
        if self.parents is not None:
            return self.parents
        return chain(with_singles(self.simultaneous or (), self.type_names))

    def _indices(self, names: Sequence[str]) -> tuple[int, ...]:
        return tuple(self.type_names.index(name) for name in names)

    def _take_rovers_of_types(self, crew: tuple[RoverType, ...]) -> None:
        for field in OF_A_TYPE:
            value = getattr(self, field)
            if value != type(self).__dataclass_fields__[field].default:
                raise UserError(f"{field} = {value!r}: not with rover_types, which say it; leave it out")
        if self.breakdowns != 0:
            raise UserError(f"breakdowns = {self.breakdowns!r}: not with rover_types; leave it out")
        rovers = sum(kind.rovers for kind in crew)
        if self.n_agents not in (1, rovers):
            raise UserError(
                f"n_agents = {self.n_agents!r}: rover_types have {rovers} together; give {rovers} or leave "
                "it out"
            )
        object.__setattr__(self, "n_agents", rovers)

    def _check_sizes(self) -> None:
        for field in ("n_agents", "n_poi_types", "pois_per_type", "spatial_coupling", "episode_length"):
            check_count(field, getattr(self, field))
        for field in ("world_size", "max_turn", "max_speed", "activation_distance", "min_distance"):
            check_positive(field, getattr(self, field))
        check_speed("poi_speed", self.poi_speed, self.world_size)
        if self.observation_radius is not None:
            check_positive("observation_radius", self.observation_radius)
        if self.n_poi_types > len(string.ascii_uppercase):
            raise UserError(f"n_poi_types = {self.n_poi_types}: at most {len(string.ascii_uppercase)} types")
        if self.spatial_coupling > self.n_agents:
            raise UserError(
                f"spatial_coupling = {self.spatial_coupling}: above the number of rovers, "
                f"n_agents = {self.n_agents}, so that no POI could ever be observed; "
                "lower spatial_coupling or raise n_agents"
            )
        check_resolution("sensor_resolution", self.sensor_resolution)

    def _check_choices(self) -> None:
        choices = {"sensor": ("density", "closest"), "observed_pois": ("persist", "vanish")}
        choices |= {"team_reward": get_args(TeamReward), "order": ("fixed", "drawn")}
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
        for kind in self.rover_types or ():
            if (needed := kind.coupling * self.largest_group) > kind.rovers:
                raise UserError(
                    f"simultaneous = {self.simultaneous}: the largest group takes {needed} of rover type "
                    f"{kind.name} at once, above rovers = {kind.rovers}; lower its coupling or raise rovers"
                )
        needed = self.spatial_coupling * self.largest_group
        if needed > self.n_agents:
            raise UserError(
                f"simultaneous = {self.simultaneous}: the largest group takes {needed} rovers at once, "
                f"above n_agents = {self.n_agents}; lower spatial_coupling or raise n_agents"
            )
        broken, spare = self.breakdowns, self.n_agents - needed
        check_count("breakdowns", broken, least=0)
        if broken > spare:
            raise UserError(
                f"breakdowns = {broken}: no rover to spare, since {needed} of n_agents = {self.n_agents} are "
                f"needed at once; give at most {spare}"
            )
