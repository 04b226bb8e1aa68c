"""Numbers to compare algorithms by, from their learning curves and final scores. NumPy alone.

Interquartile means, their stratified bootstrap and the probability of improvement follow Agarwal et
al. 2021 (Deep reinforcement learning at the edge of the statistical precipice).
"""

from typing import Any

import numpy as np
from jaxtyping import Float, Real

from skillcrew.intervals import Interval, widened

RESAMPLES = 10_000
"""Of each bootstrap."""

Scores = Float[np.ndarray, "tasks _"]
"""One row per task, of the scores of its seeds."""


def area_under_curve(
    steps: Real[np.ndarray, " rows"],
    values: Float[np.ndarray, " rows"],
    horizon: float | int,
    start: float | None = 0.0,
) -> float:
    """The mean of one seed's curve over the environment steps from 0 to `horizon`.

    The curve is linear between rows, and keeps its last value if it ends before.

    Args:
        start: what it begins with; None for its first value.
    """
    x = np.concatenate([[0.0], np.asarray(steps, float)])
    y = np.concatenate([[values[0] if start is None else start], np.asarray(values, float)])
    inside = x < horizon
    x_cut = np.concatenate([x[inside], [horizon]])
    y_cut = np.concatenate([y[inside], [np.interp(horizon, x, y)]])
    return float(np.trapezoid(y_cut, x_cut) / horizon)


def interquartile_mean(scores: Float[np.ndarray, "*any"]) -> float:
    """The mean of the middle half of all scores: a quarter is cut from either end, rounded down."""
    return float(_middle_mean(np.ravel(np.asarray(scores, float))))


def interquartile_interval(scores: Scores, seed: int = 0, episodes: int | None = None) -> Interval:
    """The interquartile mean over tasks and seeds, with its stratified-bootstrap 95 % interval.

    Resampling seeds that agree leaves that no width: each end is at least as far out as Wilson's for the
    episodes of the middle half of the scores together.

    Args:
        episodes: of each seed, if its score is the share of them that succeeded.
    """
    drawn = _resampled(scores, np.random.default_rng(seed)).reshape(RESAMPLES, -1)
    interval = _with_interval(interquartile_mean(scores), _middle_mean(drawn))
    kept = scores.size - 2 * (scores.size // 4)
    return widened(interval, None if episodes is None else kept * episodes)


def probability_of_improvement(scores: Scores, others: Scores, seed: int = 0) -> Interval:
    """How likely a run of the one beats a run of the other on a task, averaged over tasks, ties as halves.

    The interval is the stratified bootstrap's; where resampling leaves that no width, as where all seeds of
    the one beat all of the other, it is Wilson's for as many independent pairs as there are.

    Args:
        scores: of the same tasks in the same order as `others`; they may have other numbers of seeds.
    """
    rng = np.random.default_rng(seed)
    drawn = _share_better(_resampled(scores, rng), _resampled(others, rng))
    interval = _with_interval(float(_share_better(scores, others)), drawn)
    pairs = len(scores) * min(scores.shape[1], others.shape[1])
    return widened(interval, pairs) if np.ptp(drawn) == 0 else interval


def _middle_mean(scores: Float[np.ndarray, "*any all"]) -> Any:
    ordered = np.sort(scores, axis=-1)
    cut = scores.shape[-1] // 4
    return ordered[..., cut : scores.shape[-1] - cut].mean(-1)


def _share_better(
    scores: Float[np.ndarray, "*any tasks ours"], others: Float[np.ndarray, "*any tasks theirs"]
) -> Any:
    one, other = scores[..., :, None], others[..., None, :]
    return ((one > other) + 0.5 * (one == other)).mean((-3, -2, -1))


def _resampled(scores: Scores, rng: np.random.Generator) -> Float[np.ndarray, "resamples tasks _"]:
    """Seeds drawn anew within each task, `RESAMPLES` times."""
    drawn = rng.integers(0, scores.shape[1], (RESAMPLES, *scores.shape))
    return np.take_along_axis(scores[None], drawn, axis=2)


def _with_interval(estimate: float, resampled: Float[np.ndarray, " resamples"]) -> Interval:
    """An estimate with the 95 % percentile interval of its resamples."""
    low, high = np.percentile(resampled, [2.5, 97.5])
    return Interval(estimate, float(low), float(high))
