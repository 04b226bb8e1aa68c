"""What was read of files that have not changed since."""

import collections
import os
from collections.abc import Callable, Hashable, Sequence
from pathlib import Path
from typing import Any, TypeVar

Value = TypeVar("Value")

Stamp = tuple[tuple[int, int, int] | None, ...]


def stamp(paths: Sequence[Path]) -> Stamp:
    """Is another one once any of these files is; of one that is not there it is None."""
    return tuple(map(_stamp, paths))


def _stamp(path: Path) -> tuple[int, int, int] | None:
    try:
        about = os.stat(path)
    except OSError:
        return None
    return about.st_mtime_ns, about.st_size, about.st_ino


class Remembered:
    """Values by key, each as long as nothing that it was made of has changed; the oldest are forgotten.

    Args:
        most: values that are kept.
    """

    def __init__(self, most: int):
        self._most = most
        self._kept: collections.OrderedDict[Hashable, tuple[Any, Any]] = collections.OrderedDict()

    def has(self, key: Hashable, state: Any) -> bool:
        """Whether the value is known."""
        return key in self._kept and self._kept[key][0] == state

    def get(self, key: Hashable, state: Any, make: Callable[[], Value]) -> Value:
        """The value, which `make` makes if the state is not that of the last time."""
        if not self.has(key, state):
            self.put(key, state, make())
        self._kept.move_to_end(key)
        return self._kept[key][1]

    def put(self, key: Hashable, state: Any, value: Any) -> None:
        """Remembers a value."""
        self._kept[key] = (state, value)
        self._kept.move_to_end(key)
        while len(self._kept) > self._most:
            self._kept.popitem(last=False)
