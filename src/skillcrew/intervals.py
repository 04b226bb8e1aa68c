"""Means with their 95 % intervals, over episodes and over seeds."""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Real
from scipy.special import stdtrit

from skillcrew.errors import UserError

NORMAL_QUANTILE = 1.959963984540054
"""The 97.5 % quantile of the normal distribution: what two-sided 95 % intervals use."""


@dataclass(frozen=True)
class Interval:
    """A mean with its 95 % interval, all in the unit of what was averaged."""

    mean: float
    low: float
    high: float
    """NaN, as is `low`, where a single value leaves the spread unknown."""


def proportion_interval(successes: int, trials: int) -> Interval:
    """The share of successes with its Wilson 95 % interval, in [0, 1].

    Wilson's and not the textbook's p ± 1.96·√(p(1-p)/n), whose width is zero after 0 or 100 %
    successes, as is common for a sparse team reward.

    Args:
        successes: 0 to `trials`.
        trials: independent episodes, at least 1.

    Returns:
        `mean` is the plain share of successes; the interval is not symmetric about it.

    Raises:
        UserError: no trials.
        ValueError: successes outside 0 to `trials`.
    """
    if trials < 1:
        raise UserError(f"a success rate needs at least 1 episode, not {trials}")
    if not 0 <= successes <= trials:
        raise ValueError(f"successes must be 0 to {trials} (the trials), not {successes}")
    return wilson(successes / trials, trials)


def wilson(share: float, trials: int) -> Interval:
    """Wilson's 95 % interval of a share, 0 to 1, of some independent trials, at least 1."""
    z = NORMAL_QUANTILE
    shrink = 1 / (1 + z**2 / trials)
    centre = shrink * (share + z**2 / (2 * trials))
    half = shrink * z * math.sqrt(share * (1 - share) / trials + (z / (2 * trials)) ** 2)
    # The share is within, and both ends are exact at the borders; floating point alone leaves 1e-17 there.
    low = 0.0 if share == 0 else min(centre - half, share)
    high = 1.0 if share == 1 else max(centre + half, share)
    return Interval(share, low, high)


def seed_interval(
    values: Real[np.ndarray, " seeds"], lower: float = 0.0, upper: float = 1.0, episodes: int | None = None
) -> Interval:
    """The mean over seeds with its 95 % Student-t interval, clipped to a range.

    Seeds are the independent units here: episodes of one seed share a team, so pooling them alone
    would make the interval too narrow. With a single seed `low` and `high` are NaN. Seeds that
    agree exactly (all at 0 or all at 1) leave Student's t no width, which says that they agree and not
    that the mean is certain: so each end is at least as far out as Wilson's for the episodes of all
    seeds together. What seeds that were not trained would do is beyond that.

    Args:
        values: one number per seed, at least one. A NaN makes the whole result NaN: to leave a
            failed seed out unseen would flatter the mean.
        lower: the least possible value; -inf for none.
        upper: the greatest possible value; inf for none.
        episodes: of each seed, if its value is the share of them that succeeded.

    Raises:
        ValueError: no seeds.
    """
    values = np.asarray(values, dtype=float)
    if not len(values):
        raise ValueError("there must be at least one seed")
    mean, low, high = (float(one[0]) for one in t_interval(values[:, None], lower, upper))
    return widened(Interval(mean, low, high), None if episodes is None else len(values) * episodes)


def difference_interval(
    ours: Real[np.ndarray, " seeds"],
    theirs: Real[np.ndarray, " others"],
    paired: bool,
    episodes: int | None = None,
) -> Interval:
    """By how much the mean of some seeds is above that of others, with its 95 % interval.

    Student's t over the differences of pairs, or Welch's where there are none. Methods that both
    succeed always differ by nothing, which leaves that no width: so each end is at least as far out as
    Newcombe's for the episodes of all seeds together (1998, method 10). NaN ends as in `seed_interval`.

    Args:
        paired: whether both are of the same seeds in the same order.
        episodes: of each seed, if its value is the share of them that succeeded.
    """
    ours, theirs = np.asarray(ours, float), np.asarray(theirs, float)
    difference = seed_interval(ours - theirs, -math.inf, math.inf) if paired else _welch(ours, theirs)
    if episodes is None or math.isnan(difference.low):
        return difference
    one, other = (wilson(float(values.mean()), len(values) * episodes) for values in (ours, theirs))
    down = math.hypot(one.mean - one.low, other.high - other.mean)
    up = math.hypot(one.high - one.mean, other.mean - other.low)
    low, high = min(difference.low, difference.mean - down), max(difference.high, difference.mean + up)
    return Interval(difference.mean, max(low, -1.0), min(high, 1.0))


def widened(interval: Interval, episodes: int | None) -> Interval:
    """The interval of a share, and what so many episodes leave open beside it; NaN ends stay."""
    if episodes is None or math.isnan(interval.low):
        return interval
    within = wilson(min(max(interval.mean, 0.0), 1.0), episodes)
    return Interval(interval.mean, min(interval.low, within.low), max(interval.high, within.high))


def _welch(ours: Float[np.ndarray, " seeds"], theirs: Float[np.ndarray, " others"]) -> Interval:
    """The difference of two means with its 95 % interval by Welch's t; NaN ends with a single seed."""
    difference = float(ours.mean() - theirs.mean())
    if min(len(ours), len(theirs)) < 2:
        return Interval(difference, math.nan, math.nan)
    one, other = ours.var(ddof=1) / len(ours), theirs.var(ddof=1) / len(theirs)
    if one + other == 0:
        return Interval(difference, difference, difference)
    freedom = (one + other) ** 2 / (one**2 / (len(ours) - 1) + other**2 / (len(theirs) - 1))
    half = float(stdtrit(freedom, 0.975) * math.sqrt(one + other))
    return Interval(difference, difference - half, difference + half)


def t_interval(
    values: Float[np.ndarray, "seeds points"], lower: float, upper: float
) -> tuple[Float[np.ndarray, " points"], Float[np.ndarray, " points"], Float[np.ndarray, " points"]]:
    """Mean, low and high over the first axis; the ends are clipped, but never past the mean."""
    n_seeds = len(values)
    mean = np.mean(values, axis=0)
    if n_seeds == 1:
        unknown = np.full_like(mean, np.nan)
        return mean, unknown, unknown
    half = stdtrit(n_seeds - 1, 0.975) * np.std(values, axis=0, ddof=1) / math.sqrt(n_seeds)
    # The inner bound is for means a rounding error beyond the range.
    low = np.minimum(np.maximum(mean - half, lower), mean)
    high = np.maximum(np.minimum(mean + half, upper), mean)
    return mean, low, high
