"""Which numbers a Rover Domain can be made of."""

import math
from collections.abc import Sequence
from typing import Any

from skillcrew.errors import UserError


def check_count(field: str, value: Any, least: int = 1) -> None:
    """Refuses what is no whole number of at least `least`."""
    if isinstance(value, bool) or not isinstance(value, int) or value < least:
        raise UserError(f"{field} = {value!r}: give a whole number of at least {least}")


def check_positive(field: str, value: Any) -> None:
    """Refuses what is no positive, finite number."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value < math.inf:
        raise UserError(f"{field} = {value!r}: give a positive number")


def check_speed(field: str, value: Any, most: int | float) -> None:
    """Refuses what no POI can move in a step."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value <= most:
        raise UserError(f"{field} = {value!r}: give a number from 0 to world_size = {most}")


def check_resolution(field: str, value: Any) -> None:
    """Refuses what does not divide the circle."""
    whole = isinstance(value, int) and not isinstance(value, bool)
    if not whole or value < 1 or 360 % value:
        raise UserError(f"{field} = {value!r}: give whole degrees that divide 360, such as 90")


def checked_values(values: Any, n_poi_types: int) -> tuple[float, ...]:
    """One positive number for each type."""
    mend = f"poi_values = {values!r}: give {n_poi_types} positive numbers, one per POI type"
    if isinstance(values, str) or not isinstance(values, Sequence) or len(values) != n_poi_types:
        raise UserError(mend)
    for value in values:
        if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value < math.inf:
            raise UserError(mend)
    return tuple(float(value) for value in values)
