"""How a run learned: its champions' score over environment steps, as a curve."""

from collections.abc import Sequence

import numpy as np

from skillcrew.analysis.curves import Curve
from skillcrew.analysis.levels import Windows
from skillcrew.analysis.statistics import NoCurve, mean_band
from skillcrew.errors import UserError
from skillcrew.experiment.config import RunConfig
from skillcrew.experiment.metrics import MOVE_AWAY, Columns
from skillcrew.experiment.run import Run
from skillcrew.experiment.score import RETURN, Score, score_of


def learning_curve(
    run: Run, label: str | None = None, logarithmic: bool = False, budget: float | int | None = None
) -> Curve:
    """The champion's score on fresh episodes over environment steps, per seed and as a mean with its band.

    The mean is smoothed over the trailing window of `Windows`; single seeds are as they are.

    Args:
        logarithmic: whether the band is for a logarithmic axis of steps.
        budget: environment steps that the window is a share of, the same for all curves that are compared; by
            default the run's own.

    Raises:
        NoCurve: there are no rows to draw one of.
        UserError: the metrics are damaged.
    """
    if not run.folder.metrics.exists():
        raise NoCurve(f"{run.folder.metrics}: is not there, and no learning curve can be drawn without it")
    columns = run.metrics()
    score = score_of(run.algorithm.env)
    if score.key not in columns:
        # The environment says what success is since the run was trained.
        score = RETURN
    per_seed = [within_budget(columns, score, seed, run.config.steps) for seed in run.config.seeds]
    if min(len(steps) for steps, _ in per_seed) == 0:
        raise NoCurve(
            f"{run.folder.metrics}: a seed has no generation yet; train longer before drawing a curve"
        )
    return curve_over_seeds(label or run.algorithm.label, [run.config], per_seed, score, logarithmic, budget)


def curve_over_seeds(
    label: str,
    configs: Sequence[RunConfig],
    per_seed: Sequence[tuple[np.ndarray, np.ndarray]],
    score: Score,
    logarithmic: bool,
    budget: float | int | None,
) -> Curve:
    """The curve over seeds that may be of several runs."""
    band = mean_band(
        [steps for steps, _ in per_seed],
        [values for _, values in per_seed],
        window=Windows.of(budget or max(config.steps for config in configs)).trailing,
        lower=score.lower,
        upper=score.upper,
        logarithmic=logarithmic,
        episodes=min(config.score_episodes for config in configs) if score.bounded else None,
    )
    return Curve(label, band, per_seed, score=score)


def within_budget(columns: Columns, score: Score, seed: int, budget: int) -> tuple[np.ndarray, np.ndarray]:
    """One seed's environment steps and scores, of the generations within its budget.

    Raises:
        UserError: steps do not increase from row to row, as those that skillcrew writes do.
    """
    rows = (columns["seed"] == seed) & (columns["environment_steps"] <= budget)
    steps = columns["environment_steps"][rows]
    # Compared and not subtracted: a difference may not fit its type.
    if (steps[1:] <= steps[:-1]).any():
        raise UserError(
            f"metrics.parquet: damaged, environment steps of seed {seed} do not increase; {MOVE_AWAY}"
        )
    return steps, columns[score.key][rows]
