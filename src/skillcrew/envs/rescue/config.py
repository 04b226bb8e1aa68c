"""Every option of search and rescue, checked where it is written down."""

import dataclasses
import math

from skillcrew.envs.option_checks import check_counts, check_coupling, check_positive
from skillcrew.errors import UserError

BASE_SHARE = 0.3
"""The base lies in this central share of each axis."""

SKILL_TEXTS = {
    "go_to_victim": "Goes to the nearest victim within its sensor's radius, or stays with the one it holds.",
    "go_to_call": "Goes to the nearest victim that another agent reports.",
    "go_to_base": "Goes to the base.",
    "search": "Goes to places that nobody has searched yet, those first that no one else is nearer to.",
    "go_to_agent": "Goes to the nearest other agent.",
    "go_away_from_agent": "Goes away from the nearest other agent.",
}
"""What each skill does, in the order of the local rewards."""


@dataclasses.dataclass(frozen=True)
class RescueConfig:
    """Search and rescue. Lengths are in metres, speeds in metres per step.

    Raises:
        UserError: a value out of range, or options that leave nothing to search or nobody to lift.
    """

    n_agents: int = 3
    """Agents in the team; at least 2."""
    n_victims: int = 1
    """Victims to be found and brought to the base."""
    coupling: int = 2
    """Agents that it takes to lift a victim, and to keep it lifted."""
    episode_length: int = 50
    """Steps until an unfinished episode is truncated."""
    world_size: float = 16.0
    """Side of the square, which agents cannot leave."""
    max_speed: float = 1.0
    """Largest distance that an agent goes in a step."""
    carry_speed: float = 0.7
    """The same for an agent that holds a victim; at most `max_speed`."""
    sensor_radius: float = 3.0
    """Within this distance an agent senses victims."""
    reach: float = 1.5
    """Within this distance of a victim an agent lifts it, and holds it until it is farther away."""
    base_radius: float = 2.0
    """Within this distance of the base a victim is saved. Agents start in the square around that circle."""
    victim_distance: float = 5.5
    """Least distance of a victim from the base at the start; up to 0.35 times `world_size`."""
    cells: int = 6
    """Places to search along each axis: the square is divided into so many times so many cells."""

    def __post_init__(self) -> None:
        check_counts(self, ("n_agents", "n_victims", "coupling", "episode_length", "cells"))
        check_positive(
            self,
            (
                *("world_size", "max_speed", "carry_speed", "sensor_radius", "reach", "base_radius"),
                "victim_distance",
            ),
        )
        if self.n_agents < 2:
            raise UserError(f"n_agents = {self.n_agents}: give at least 2, who can go to one another")
        check_coupling(self, "victim")
        if self.carry_speed > self.max_speed:
            raise UserError(
                f"carry_speed = {self.carry_speed}: above max_speed = {self.max_speed}; lower carry_speed"
            )
        most = (1 - BASE_SHARE) / 2 * self.world_size
        if not self.base_radius < self.victim_distance <= most:
            raise UserError(
                f"victim_distance = {self.victim_distance}: give a number above base_radius = "
                f"{self.base_radius}, so that victims have to be saved, and up to {most:g}, so that there is "
                "room for them"
            )
        if self.searched_radius <= 0:
            raise UserError(
                f"cells = {self.cells}: cells of {self.cell_size:g} m are too large to be sensed as a whole "
                f"with sensor_radius = {self.sensor_radius}; give more cells"
            )

    @property
    def skills(self) -> tuple[str, ...]:
        """In the order of the local rewards."""
        return tuple(SKILL_TEXTS)

    @property
    def cell_size(self) -> float:
        """Side of a cell."""
        return self.world_size / self.cells

    @property
    def searched_radius(self) -> float:
        """Within this distance of a cell's centre an agent senses the whole cell."""
        return self.sensor_radius - self.cell_size / math.sqrt(2)

    def summary(self) -> str:
        """One line on sizes."""
        return (
            f"{self.n_agents} agents, {self.n_victims} victim(s), coupling {self.coupling}, "
            f"{self.episode_length} steps"
        )
