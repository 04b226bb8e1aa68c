"""Checks that several domains' options share."""

import math
from collections.abc import Iterable
from typing import Any

from skillcrew.errors import UserError


def check_counts(config: Any, fields: Iterable[str]) -> None:
    """Raises `UserError` unless each field is a whole number of at least 1."""
    for field in fields:
        value = getattr(config, field)
        if isinstance(value, bool) or not isinstance(value, int) or value < 1:
            raise UserError(f"{field} = {value!r}: give a whole number of at least 1")


def check_positive(config: Any, fields: Iterable[str]) -> None:
    """Raises `UserError` unless each field is a finite number above 0."""
    for field in fields:
        value = getattr(config, field)
        if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value < math.inf:
            raise UserError(f"{field} = {value!r}: give a positive number")


def check_coupling(config: Any, load: str) -> None:
    """Raises `UserError` if there are not as many agents as a load takes."""
    if config.coupling > config.n_agents:
        raise UserError(
            f"coupling = {config.coupling}: above n_agents = {config.n_agents}, so that no {load} could ever "
            "be lifted; lower coupling or raise n_agents"
        )
