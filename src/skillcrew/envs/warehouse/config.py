"""Every option of the warehouse, checked where it is written down."""

import dataclasses
import string

from skillcrew.envs.option_checks import check_counts, check_coupling, check_positive
from skillcrew.errors import UserError


@dataclasses.dataclass(frozen=True)
class WarehouseConfig:
    """A warehouse. Lengths are in metres, speeds in metres per step.

    Raises:
        UserError: a value out of range, or options that leave nobody to lift or no room to pass.
    """

    n_agents: int = 2
    """Agents in the team."""
    n_orders: int = 1
    """Orders in an episode, each of one load that lies on a shelf and is to be brought to a station."""
    coupling: int = 2
    """Agents that it takes to lift a load, and to keep it lifted."""
    n_shelves: int = 3
    """Shelves along one end, called A, B, …; at most 26."""
    n_stations: int = 2
    """Stations along the other end, called 1, 2, …"""
    episode_length: int = 60
    """Steps until an unfinished episode is truncated."""
    latest_order: int = 10
    """Each order comes at a step of its own, any as likely from 0 to this one."""
    length: float = 14.0
    """Length of the building, which a wall across its middle divides into the store and the counter."""
    width: float = 10.0
    """Width of the building."""
    corridor_length: float = 2.0
    """Thickness of the wall, through which a corridor leads; more than `max_speed`."""
    corridor_width: float = 2.0
    """Width of the corridor."""
    max_speed: float = 1.0
    """Largest distance that an agent goes in a step."""
    carry_speed: float = 0.7
    """The same for an agent that holds a load; at most `max_speed`."""
    reach: float = 1.5
    """Within this distance of a load an agent lifts it, and holds it until it is farther away."""
    station_radius: float = 1.5
    """Within this distance of its station a load is delivered."""

    def __post_init__(self) -> None:
        counts = ("n_agents", "n_orders", "coupling", "n_shelves", "n_stations", "episode_length")
        check_counts(self, counts)
        lengths = ("length", "width", "corridor_length", "corridor_width", "max_speed", "carry_speed")
        check_positive(self, (*lengths, "reach", "station_radius"))
        check_coupling(self, "load")
        latest = self.latest_order
        if isinstance(latest, bool) or not isinstance(latest, int) or not 0 <= latest < self.episode_length:
            raise UserError(
                f"latest_order = {latest!r}: give a step from 0 to below episode_length = "
                f"{self.episode_length}"
            )
        if self.n_shelves > len(string.ascii_uppercase):
            raise UserError(f"n_shelves = {self.n_shelves}: at most {len(string.ascii_uppercase)} shelves")
        if self.carry_speed > self.max_speed:
            raise UserError(
                f"carry_speed = {self.carry_speed}: above max_speed = {self.max_speed}; lower carry_speed"
            )
        if self.corridor_length <= self.max_speed:
            raise UserError(
                f"corridor_length = {self.corridor_length}: agents would step through the wall; give more "
                f"than max_speed = {self.max_speed}"
            )
        if self.corridor_width > self.width / 2:
            raise UserError(
                f"corridor_width = {self.corridor_width}: give at most half of width = {self.width}"
            )
        if self.length / 2 - self.corridor_length / 2 < self.station_radius + MARGIN:
            raise UserError(
                f"length = {self.length}: no room beside the wall; give at least "
                f"{2 * (self.station_radius + MARGIN) + self.corridor_length:g}"
            )

    @property
    def skills(self) -> tuple[str, ...]:
        """In the order of the local rewards."""
        return tuple(self.skill_texts)

    @property
    def skill_texts(self) -> dict[str, str]:
        """What each skill does."""
        shelves = {f"go_to_shelf_{name}": f"Goes to shelf {name}." for name in self.shelf_names}
        stations = {f"go_to_station_{name}": f"Goes to station {name}." for name in self.station_names}
        return {**shelves, **stations, "stand_aside": "Keeps away from the corridor."}

    @property
    def shelf_names(self) -> tuple[str, ...]:
        """By letters: A, B and so on."""
        return tuple(string.ascii_uppercase[: self.n_shelves])

    @property
    def station_names(self) -> tuple[str, ...]:
        """By numbers: 1, 2 and so on."""
        return tuple(str(station + 1) for station in range(self.n_stations))

    def summary(self) -> str:
        """One line on sizes."""
        return (
            f"{self.n_agents} agents, {self.n_orders} order(s), coupling {self.coupling}, "
            f"{self.n_shelves} shelves, {self.n_stations} stations, {self.episode_length} steps"
        )


MARGIN = 1.0
"""Metres from the ends of the building to shelves and stations."""
