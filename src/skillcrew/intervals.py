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
    share, z = successes / trials, NORMAL_QUANTILE
    shrink = 1 / (1 + z**2 / trials)
    centre = shrink * (share + z**2 / (2 * trials))
    half = shrink * z * math.sqrt(share * (1 - share) / trials + (z / (2 * trials)) ** 2)
    # Both ends are exact at the borders; floating point alone leaves 1e-17 there.
    low = 0.0 if successes == 0 else centre - half
    high = 1.0 if successes == trials else centre + half
    return Interval(share, low, high)


def seed_interval(values: Real[np.ndarray, " seeds"], lower: float = 0.0, upper: float = 1.0) -> Interval:
    """The mean over seeds with its 95 % Student-t interval, clipped to a range.

    Seeds are the independent units here: episodes of one seed share a team, so pooling them
    would make the interval too narrow. With a single seed `low` and `high` are NaN. Seeds that
    agree exactly (all at 0 or all at 1) give an interval of no width, which says that they agree
    and not that the mean is certain.

    Args:
        values: one number per seed, at least one. A NaN makes the whole result NaN: to leave a
            failed seed out unseen would flatter the mean.
        lower: the least possible value; -inf for none.
        upper: the greatest possible value; inf for none.

    Raises:
        ValueError: no seeds.
    """
    values = np.asarray(values, dtype=float)
    if not len(values):
        raise ValueError("there must be at least one seed")
    mean, low, high = t_interval(values[:, None], lower, upper)
    return Interval(float(mean[0]), float(low[0]), float(high[0]))


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
