"""What a tracker is told."""

import importlib
import importlib.util
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple, Protocol, runtime_checkable

from skillcrew.errors import UserError
from skillcrew.experiment.metrics import Columns
from skillcrew.experiment.trackers.names import TRACKERS


class Tracked(NamedTuple):
    """What a tracker knows of a run."""

    run: str
    """Name of the run's folder."""
    place: Path
    """The tracker's own folder, inside that of the run."""
    identity: str
    """Letters and digits that no other run has; the same when the run goes on."""
    seeds: tuple[int, ...]
    text: str
    """The resolved configuration as YAML, …"""
    configuration: Mapping[str, Any]
    """… and as plain values."""
    begins: bool
    """Whether nothing is recorded yet."""


@runtime_checkable
class Tracker(Protocol):
    """Keeps one record for each seed. What it raises ends the record and not the run."""

    def __init__(self, tracked: Tracked): ...

    @staticmethod
    def check() -> None:
        """Raises `UserError` if nothing can be recorded here."""
        ...

    def record(self, seed: int, columns: Columns) -> None:
        """Rows of one seed that were not recorded before, at least one, by generation."""
        ...

    def conclude(
        self, seed: int, steps: int, scores: Mapping[str, float], figures: Mapping[str, Path]
    ) -> None:
        """The champion's scores after so many environment steps, and figures of the report (PNG) by name."""
        ...

    def flush(self) -> None:
        """What was recorded is to survive the process."""
        ...

    def close(self) -> None:
        """Nothing more comes from this process."""
        ...


def tracker_class(name: str) -> type[Tracker]:
    """Imports a tracker that can be used here.

    Raises:
        UserError: its package is not installed, or is not set up.
    """
    found = importlib.util.find_spec(name)
    # W&B's own folders are called wandb, too, and any folder passes for a package without files.
    if found is None or found.origin is None:
        raise UserError(f"trackers: {name} is not installed; pip install 'skillcrew[tracking]'")
    module, _, kind = TRACKERS[name].partition(":")
    try:
        tracker: type[Tracker] = getattr(importlib.import_module(module), kind)
        tracker.check()
    except UserError:
        raise
    # Versions that do not fit each other, a key that is none, a server that is none: whatever it may be.
    except Exception as error:
        reason = str(error).strip() or type(error).__name__
        raise UserError(
            f"trackers: {name} cannot be used here: {reason}; mend that, or leave it out"
        ) from error
    return tracker


def finite(columns: Columns, row: int) -> dict[str, int | float]:
    """The numbers of one row; the loss of what did not learn is none."""
    values = {name: values[row].item() for name, values in columns.items()}
    return {name: value for name, value in values.items() if math.isfinite(value)}
