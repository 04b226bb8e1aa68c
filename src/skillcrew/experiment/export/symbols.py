"""What stands for arrays while a team's act is written down."""

import dataclasses
from typing import Any, Protocol, runtime_checkable

from skillcrew.experiment.export.interface import Port


@runtime_checkable
class Shaped(Protocol):
    """What has a shape and a type."""

    @property
    def shape(self) -> tuple[int, ...]: ...

    @property
    def dtype(self) -> Any: ...


@dataclasses.dataclass(frozen=True)
class Known:
    """An array that does not depend on what is observed."""

    array: Any
    name: str | None = None
    """In files, of one of the team's own."""

    @property
    def shape(self) -> tuple[int, ...]:
        return tuple(self.array.shape)

    @property
    def dtype(self) -> str:
        return str(self.array.dtype)


@dataclasses.dataclass(frozen=True)
class Symbol:
    """An array that some operation makes, or that goes in."""

    port: Port

    @property
    def shape(self) -> tuple[int, ...]:
        return self.port.shape

    @property
    def dtype(self) -> str:
        return self.port.dtype


@dataclasses.dataclass(frozen=True)
class Bits:
    """Random bits on their way to become the numbers that they stand for."""

    uniform: Symbol
    """Between 0 and 1."""


def as_value(value: Any) -> Known | Symbol | Bits:
    """What is no symbol is an array that JAX has put into a record itself."""
    return value if isinstance(value, Known | Symbol | Bits) else Known(value)
