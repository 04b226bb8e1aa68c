"""Rovers that differ: what those of one type can do, and how many of them a POI takes."""

import dataclasses
import math
import re
from collections.abc import Sequence
from typing import Any, ClassVar

from skillcrew.envs.rover.checks import check_count, check_positive, check_resolution
from skillcrew.errors import UserError


@dataclasses.dataclass(frozen=True)
class RoverType:
    """Some rovers of a crew that are alike. Lengths are in metres, angles in radians unless said.

    Raises:
        UserError: a value out of range, or more rovers needed at a POI than there are.
    """

    __pydantic_config__: ClassVar[dict[str, str]] = {"extra": "forbid"}

    name: str
    """Letters, digits and underscores; what observations, actions and skills are called by."""
    rovers: int
    """How many there are."""
    coupling: int = 1
    """How many must be within the activation distance of a POI in the same step; 0: none are needed."""
    max_turn: float = math.pi
    """Largest change of heading in a step."""
    max_speed: float = 1.0
    """Largest drive in a step."""
    observation_radius: float | None = None
    """Nothing farther than this is sensed. Default: no limit."""
    sensor_resolution: int = 90
    """Degrees per sector; divides 360."""

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or re.fullmatch(r"\w+", self.name) is None:
            raise UserError(f"rover type {self.name!r}: give a name of letters, digits and underscores")
        said = f"rover type {self.name}: "
        check_count(f"{said}rovers", self.rovers)
        check_count(f"{said}coupling", self.coupling, least=0)
        for field in ("max_turn", "max_speed"):
            check_positive(f"{said}{field}", getattr(self, field))
        if self.observation_radius is not None:
            check_positive(f"{said}observation_radius", self.observation_radius)
        check_resolution(f"{said}sensor_resolution", self.sensor_resolution)
        if self.coupling > self.rovers:
            raise UserError(
                f"{said}coupling = {self.coupling}: above rovers = {self.rovers}, so that no POI could ever "
                "be observed; lower coupling or raise rovers"
            )

    @property
    def sectors(self) -> int:
        """Of its sensor."""
        return 360 // self.sensor_resolution


Ranks = tuple[tuple[RoverType, slice], ...]
"""Each type, and which of all rovers are of it."""


def checked_crew(types: Any) -> tuple[RoverType, ...]:
    """Types of rovers as a tuple.

    Raises:
        UserError: no list of them, a name given twice, or no rover needed at a POI.
    """
    if not isinstance(types, Sequence) or not all(isinstance(kind, RoverType) for kind in types):
        raise UserError(f"rover_types = {types!r}: give a list of RoverType, such as [RoverType('scout', 2)]")
    names = [kind.name for kind in types]
    for name in names:
        if names.count(name) > 1:
            raise UserError(f"rover_types = {', '.join(names)}: {name} is named twice; give each name once")
    if types and not any(kind.coupling for kind in types):
        raise UserError(
            f"rover_types = {', '.join(names)}: coupling = 0 in all, so that a POI needs no rover; give one "
            "at least 1"
        )
    return tuple(types)


def ranks(crew: Sequence[RoverType]) -> Ranks:
    """Who is of which type: rovers stand type by type."""
    first, found = 0, []
    for kind in crew:
        found.append((kind, slice(first, first + kind.rovers)))
        first += kind.rovers
    return tuple(found)


def of_each(crew: Sequence[RoverType], field: str) -> list[Any]:
    """What a field of its type says, for each rover."""
    return [getattr(kind, field) for kind in crew for _ in range(kind.rovers)]
