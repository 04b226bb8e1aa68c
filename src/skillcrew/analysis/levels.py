"""When a learning curve reached a level, and held it. NumPy alone.

Why windows are what they are: `docs/scores-and-curves.md`, and measured in `tests/analysis/test_levels.py`.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int, Real

LEAST_ROWS = 8
"""Generations that a level is to be held for, however long they are: a champion is scored on few episodes, so
that fewer generations would hold one by luck."""

TOLERANCE = 1e-6
"""Metrics are in single precision, in which 90 of 100 episodes are a little below 0.9."""


@dataclass(frozen=True)
class Windows:
    """Stretches of environment steps that scores are averaged over, the same for all that is compared."""

    trailing: float | int
    """Looking back from a generation, its own score included."""
    following: float | int
    """After a generation, for which a level is to be held; see `LEAST_ROWS`."""

    @classmethod
    def of(cls, budget: float | int) -> "Windows":
        """A fortieth and a quarter of a budget of environment steps, but at most 50 k and 500 k."""
        return cls(min(50e3, budget / 40), min(500e3, budget / 4))


@dataclass(frozen=True)
class Reaching:
    """Whether one seed reached a level, and when."""

    steps: float | int
    """Environment steps after which it did; if it did not, those within which it certainly did not."""
    held: bool
    """Whether it did."""


def trailing_mean(
    steps: Real[np.ndarray, " rows"], values: Real[np.ndarray, " rows"], window: float | int
) -> tuple[Float[np.ndarray, " rows"], Int[np.ndarray, " rows"]]:
    """Each row's mean with the rows less than a window of steps before it, and how many those are.

    Args:
        steps: environment steps, strictly increasing.
        window: environment steps; up to the distance of two rows it smooths nothing.
    """
    steps, values = np.asarray(steps, float), np.asarray(values, float)
    rows = np.arange(len(steps))
    first = np.minimum(np.searchsorted(steps, steps - window, side="right"), rows)
    # Summed afresh for each row: the differences of a running sum would pile up rounding errors.
    means = [values[begin : row + 1].mean() for begin, row in zip(first, rows, strict=True)]
    return np.array(means, float), rows - first + 1


def reaching(
    steps: Real[np.ndarray, " rows"],
    values: Real[np.ndarray, " rows"],
    level: float,
    windows: Windows,
    budget: float | int,
) -> Reaching:
    """When one seed's curve reached a level and held it.

    It did at the first row at which the mean over the trailing window is at the level, and so is the mean of
    the rows within the following window, or of the next `LEAST_ROWS` if those are more. Where the run ends
    within the following window of a row, nothing has been shown: the level is not reached there, and
    `Reaching.steps` is no more than such a row's if its trailing mean is at the level.

    Args:
        steps: environment steps, strictly increasing, within the budget.
        values: of the same rows; those with NaN (nothing measured) are skipped.
        budget: environment steps that the seed lived.
    """
    kept = ~np.isnan(np.asarray(values, float))
    steps, values = np.asarray(steps, float)[kept], np.asarray(values, float)[kept]
    high = np.flatnonzero(trailing_mean(steps, values, windows.trailing)[0] >= level - TOLERANCE)
    for row in high:
        end = max(row + 1 + LEAST_ROWS, int(np.searchsorted(steps, steps[row] + windows.following, "right")))
        if end > len(steps) or steps[row] + windows.following > steps[-1]:
            return Reaching(float(steps[row]), False)
        if values[row + 1 : end].mean() >= level - TOLERANCE:
            return Reaching(float(steps[row]), True)
    return Reaching(float(budget), False)


def restricted_mean(reached: Sequence[Reaching]) -> tuple[float, int]:
    """The mean steps to a level over all seeds, and how many reached it.

    The mean is a lower bound if not all did: the others count with the steps within which they did not.
    A mean over those that got there alone would flatter a method that rarely does.
    """
    return float(np.mean([one.steps for one in reached])), sum(one.held for one in reached)
