"""The report of a run: its learning curve, and who chose which skill when."""

import json
from pathlib import Path

import numpy as np

from skillcrew.analysis.canvas import save
from skillcrew.analysis.curves import Curve, learning_curves
from skillcrew.analysis.levels import Windows
from skillcrew.analysis.skill_figures import skill_distribution
from skillcrew.analysis.statistics import mean_band
from skillcrew.errors import UserError
from skillcrew.experiment.evaluation import Evaluation
from skillcrew.experiment.files import write_whole
from skillcrew.experiment.metrics import Columns
from skillcrew.experiment.run import Run
from skillcrew.experiment.score import RETURN, Score, score_of


def write_report(run: Run, evaluation: Evaluation, folder: Path | None = None) -> list[Path]:
    """Draws the learning curve over all seeds and each seed's chosen skills, and writes the scores.

    The chosen skills are those that the champions really chose in the episodes of `evaluation`.

    Returns:
        The files written, the learning curve first.

    Raises:
        UserError: there is nothing to draw, or it cannot be written.
    """
    if folder is None:
        run.folder.check_own()
        folder = run.folder.report
    title = f"{run.algorithm.label} on {run.algorithm.env.name}"
    written = save(learning_curves([learning_curve(run)], title), folder / "learning_curve")
    for seed, choices, reached in zip(evaluation.seeds, evaluation.choices, evaluation.per_seed, strict=True):
        heading = f"{title}, seed {seed}: {_said(evaluation, reached.mean)}"
        figure = skill_distribution(choices, run.algorithm.choices(), heading)
        written += save(figure, folder / f"chosen_skills_seed_{seed}")
    scores = json.dumps(evaluation.as_dict(), indent=1) + "\n"
    scores_file = folder / run.folder.scores.name
    write_whole(scores_file, lambda path: path.write_text(scores))
    return [*written, scores_file]


def _said(evaluation: Evaluation, mean: float) -> str:
    if evaluation.completed is None:
        return f"mean return {RETURN.number(mean)} in {evaluation.episodes} episodes"
    return f"{mean:.1%} of {evaluation.episodes} episodes solved"


def learning_curve(
    run: Run, label: str | None = None, logarithmic: bool = False, budget: float | int | None = None
) -> Curve:
    """The champion's score on fresh episodes over environment steps, per seed and as a mean with its band.

    The mean is smoothed over the trailing window of `Windows`; single seeds are as they are.

    Args:
        logarithmic: whether the band is for a logarithmic axis of steps.
        budget: environment steps that the window is a share of, the same for all curves that are compared; by
            default the run's own.
    """
    columns = run.metrics()
    score = score_of(run.algorithm.env)
    if score.key not in columns:
        # The environment says what success is since the run was trained.
        score = RETURN
    per_seed = [_within_budget(columns, score, seed, run.config.steps) for seed in run.config.seeds]
    steps, values = [s for s, _ in per_seed], [v for _, v in per_seed]
    if min(len(s) for s in steps) == 0:
        raise UserError(
            f"{run.folder.metrics}: a seed has no generation yet; train longer before drawing a curve"
        )
    window = Windows.of(budget or run.config.steps).trailing
    band = mean_band(
        steps,
        values,
        window=window,
        lower=score.lower,
        upper=score.upper,
        logarithmic=logarithmic,
        episodes=run.config.score_episodes if score.bounded else None,
    )
    return Curve(label or run.algorithm.label, band, per_seed, score=score)


def _within_budget(columns: Columns, score: Score, seed: int, budget: int) -> tuple[np.ndarray, np.ndarray]:
    rows = (columns["seed"] == seed) & (columns["environment_steps"] <= budget)
    return columns["environment_steps"][rows], columns[score.key][rows]
