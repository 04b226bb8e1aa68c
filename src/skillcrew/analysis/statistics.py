"""Curves averaged over seeds, and shares of skills. NumPy alone."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int, Real

from skillcrew.analysis.levels import trailing_mean
from skillcrew.errors import UserError
from skillcrew.intervals import Interval, t_interval, widened


class NoCurve(UserError):
    """There is nothing yet, or nothing left, to draw a curve of."""


@dataclass(frozen=True, eq=False)
class Band:
    """A mean curve with its 95 % interval at each point."""

    steps: Float[np.ndarray, " points"]
    """Environment steps, strictly increasing."""
    mean: Float[np.ndarray, " points"]
    low: Float[np.ndarray, " points"]
    high: Float[np.ndarray, " points"]
    """NaN, as is `low`, where there is a single seed."""


def mean_band(
    steps: Sequence[Real[np.ndarray, " _"]],
    values: Sequence[Real[np.ndarray, " _"]],
    n_points: int = 200,
    window: float | int = 0,
    lower: float = 0.0,
    upper: float = 1.0,
    logarithmic: bool = False,
    episodes: int | None = None,
) -> Band:
    """The mean curve over seeds that have been measured at different environment steps.

    Each seed's curve is interpolated linearly onto one grid, which spans only the steps that all
    seeds have reached: no curve is extrapolated, and every point averages the same seeds. At each
    point stands the interval of `seed_interval`, with the same caveats.

    Args:
        steps: for each seed its cumulative environment steps, one a row, strictly increasing.
        values: for each seed the values of the same rows; rows with NaN (nothing measured) are
            skipped.
        n_points: points of the grid, at least 2; a single one is made where the seeds share a
            single step.
        window: environment steps that a moving average covers, before interpolation and after NaN
            rows are gone; 0 smooths nothing. It looks back only, over as many rows as there are
            yet, so that smoothing never shows success before it happened.
        lower: the least possible value; the interval is clipped to it.
        upper: the greatest possible value; likewise.
        logarithmic: whether the grid is even in the logarithm of steps and not in steps, for an axis of that
            kind; an even one would leave the first decade of a long curve a few points.
        episodes: of each value, if it is the share of them that succeeded.

    Raises:
        NoCurve: a seed without any value, or seeds that share no range of steps.
        ValueError: no seeds, rows that do not match or do not increase, a bad `n_points` or `window`.
    """
    if not steps or len(steps) != len(values):
        raise ValueError(f"as many steps as values, at least 1 seed, not {len(steps)} and {len(values)}")
    if n_points < 2 or not window >= 0:
        raise ValueError(f"n_points must be at least 2, window 0, not {n_points} and {window}")
    curves = [_measured(seed, *rows) for seed, rows in enumerate(zip(steps, values, strict=True))]
    first, last = max(x[0] for x, _ in curves), min(x[-1] for x, _ in curves)
    if first > last:
        raise NoCurve(
            f"the seeds share no range of environment steps: one begins at {first:g}, one ends at {last:g}"
        )
    spaced = np.geomspace if logarithmic else np.linspace
    grid = spaced(first, last, n_points) if first < last else np.array([first])
    smooth = [(x, *trailing_mean(x, y, window)) for x, y in curves]
    on_grid = np.stack([np.interp(grid, x, means) for x, means, _ in smooth])
    band = Band(grid, *t_interval(on_grid, lower, upper))
    if episodes is None:
        return band
    rows = sum(np.interp(grid, x, averaged) for x, _, averaged in smooth)
    return _with_episodes(band, (episodes * np.asarray(rows)).astype(int))


def _with_episodes(band: Band, episodes: Int[np.ndarray, " points"]) -> Band:
    """A band of shares, and what so many episodes at each point leave open."""
    points = zip(band.mean.tolist(), band.low.tolist(), band.high.tolist(), episodes.tolist(), strict=True)
    wider = [widened(Interval(mean, low, high), count) for mean, low, high, count in points]
    low, high = (np.array([getattr(one, end) for one in wider]) for end in ("low", "high"))
    return Band(band.steps, band.mean, low, high)


def skill_shares(
    choices: Int[np.ndarray, "episodes time agents"], n_skills: int
) -> tuple[Float[np.ndarray, "time agents skills"], Int[np.ndarray, " time"]]:
    """How often each skill was chosen at each time step, among the episodes still running.

    Args:
        choices: skill indices, 0 to `n_skills` - 1, and -1 for all agents after an episode's end.
        n_skills: number of skills, at least 1.

    Returns:
        The shares, which sum to 1 over skills, or are NaN where no episode runs any more; and the
        number of episodes that run at each time step.

    Raises:
        UserError: no episodes, or none with a single step.
        ValueError: other indices, or an episode that has ended for some agents only.
    """
    choices = np.asarray(choices)
    running = choices >= 0
    if not running.any():
        raise UserError("there are no episodes whose choices of skills could be drawn")
    if choices.min() < -1 or choices.max() >= n_skills:
        raise ValueError(f"choices must be -1 to {n_skills - 1}, not {choices.min()} to {choices.max()}")
    if (running != running[:, :, :1]).any():
        raise ValueError("an episode must end, with -1 from then on, for all agents at once")
    n_running = running[:, :, 0].sum(axis=0)
    counts = np.stack([(choices == skill).sum(axis=0) for skill in range(n_skills)], axis=-1)
    # NaN and not 0: "nobody is left" must not look like "nobody chose it".
    divisor = np.where(n_running > 0, n_running, np.nan)
    return counts / divisor[:, None, None], n_running


def _measured(
    seed: int, steps: Real[np.ndarray, " _"], values: Real[np.ndarray, " _"]
) -> tuple[Float[np.ndarray, " measured"], Float[np.ndarray, " measured"]]:
    """The rows of one seed that hold a value, checked."""
    x, y = np.asarray(steps, dtype=float), np.asarray(values, dtype=float)
    if len(x) != len(y):
        raise ValueError(f"seed {seed}: steps and values must have as many rows, not {len(x)} and {len(y)}")
    kept = ~np.isnan(y)
    if not kept.any():
        raise NoCurve(f"seed {seed} (counted from 0) has no value yet: there is no curve to draw")
    x, y = x[kept], y[kept]
    # Written so that a NaN among the steps fails as well.
    if not (np.isfinite(x).all() and np.all(np.diff(x) > 0)):
        raise ValueError(
            f"seed {seed}: environment steps must be finite and strictly increase from row to row"
        )
    return x, y
