"""The report of a run: its learning curve, who chose which skill when, and the page that shows all of it."""

import contextlib
import itertools
import json
import textwrap
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from skillcrew.analysis.canvas import save
from skillcrew.analysis.curves import Curve, learning_curves
from skillcrew.analysis.levels import Windows
from skillcrew.analysis.page.contents import Pooled, RunContents
from skillcrew.analysis.page.write import write_page
from skillcrew.analysis.skill_figures import skill_distribution
from skillcrew.analysis.statistics import mean_band
from skillcrew.errors import UserError
from skillcrew.experiment.evaluation import Evaluation
from skillcrew.experiment.files import write_whole
from skillcrew.experiment.metrics import Columns
from skillcrew.experiment.recording import shown_episodes
from skillcrew.experiment.run import Run
from skillcrew.experiment.score import RETURN, Score, score_of

PAGE = "report.html"

WIDEST_LINE = 68
"""Letters that fit above the axes."""


def write_report(run: Run, evaluation: Evaluation, folder: Path | None = None) -> list[Path]:
    """Draws the learning curve over all seeds and each seed's chosen skills; writes the page and the scores.

    The chosen skills are those that the champions really chose in the episodes of `evaluation`.

    Returns:
        The files written, the page first.

    Raises:
        UserError: there is nothing to draw, or it cannot be drawn or written.
    """
    if folder is None:
        run.folder.check_own()
        folder = run.folder.report
    written = write_figures(run, evaluation, folder)
    contents = _contents(run, evaluation, run.algorithm.label, run.config.steps)
    page = write_page([contents], [], _title(run), folder / PAGE)
    return [page, *written]


def write_reports(runs: Sequence[Run], evaluations: Sequence[Evaluation], folder: Path) -> list[Path]:
    """Writes one page that shows several runs, and each one's figures into a folder of its name.

    Returns:
        The files written, the page first.

    Raises:
        UserError: as for `write_report`.
    """
    written = []
    for name, run, evaluation in zip(_folder_names(runs), runs, evaluations, strict=True):
        written += write_figures(run, evaluation, folder / name)
    longest: dict[str, int] = {}
    for run in runs:
        environment = run.algorithm.env.name
        longest[environment] = max(run.config.steps, longest.get(environment, 0))
    contents = [
        _contents(run, evaluation, name, longest[run.algorithm.env.name])
        for run, evaluation, name in zip(runs, evaluations, _names(runs), strict=True)
    ]
    environments = ", ".join(dict.fromkeys(run.algorithm.env.name for run in runs))
    title = f"{len(runs)} runs on {environments}"
    return [write_page(contents, _pooled(contents), title, folder / PAGE), *written]


def write_figures(run: Run, evaluation: Evaluation, folder: Path) -> list[Path]:
    """Draws the learning curve and the chosen skills as PNG and PDF; writes the scores, which come last."""
    title = _title(run)
    written = save(learning_curves([learning_curve(run)], _title_of_curve(run)), folder / "learning_curve")
    for seed, choices, reached in zip(evaluation.seeds, evaluation.choices, evaluation.per_seed, strict=True):
        heading = f"{title}, seed {seed}: {_said(evaluation, reached.mean)}"
        figure = skill_distribution(choices, run.algorithm.choices(), heading)
        written += save(figure, folder / f"chosen_skills_seed_{seed}")
    scores = json.dumps(evaluation.as_dict(), indent=1) + "\n"
    scores_file = folder / run.folder.scores.name
    write_whole(scores_file, lambda path: path.write_text(scores))
    return [*written, scores_file]


def _title(run: Run) -> str:
    return f"{run.algorithm.label} on {run.algorithm.env.name}"


def _title_of_curve(run: Run) -> str:
    """The same, and below it what the run began with, whose steps the curve does not show."""
    below = [part for line in run.config.origins() for part in textwrap.wrap(line, WIDEST_LINE)]
    # Between two dollars matplotlib reads mathematics, and a folder may be called anything.
    return "\n".join([_title(run), *(part.replace("$", r"\$") for part in below)])


def _contents(run: Run, evaluation: Evaluation, name: str, budget: int) -> RunContents:
    curves = [learning_curve(run, logarithmic=logarithmic, budget=budget) for logarithmic in (False, True)]
    return RunContents(run, name, evaluation, *curves, shown_episodes(run))


def _names(runs: Sequence[Run]) -> list[str]:
    """What tells runs apart: their algorithms, and their folders where these do not."""
    of_all = [(run.algorithm.label, run.algorithm.env.name) for run in runs]
    folders = _folder_names(runs)
    return [
        label if of_all.count((label, environment)) == 1 else f"{label} ({folder})"
        for (label, environment), folder in zip(of_all, folders, strict=True)
    ]


def _folder_names(runs: Sequence[Run]) -> list[str]:
    """The last part of each run's path, numbered where it comes again."""
    names: list[str] = []
    for run in runs:
        name = run.folder.path.resolve().name
        again = (f"{name}-{number}" for number in itertools.count(2))
        names.append(next(one for one in (name, *itertools.islice(again, len(runs))) if one not in names))
    return names


def _pooled(contents: Sequence[RunContents]) -> list[Pooled]:
    """The curves of all runs of one algorithm in one environment together, wherever there are several."""
    groups: dict[tuple[str, ...], list[int]] = {}
    for index, one in enumerate(contents):
        algorithm = one.run.algorithm
        groups.setdefault((algorithm.label, algorithm.env.name, one.curve.score.key), []).append(index)
    pooled = []
    for places in groups.values():
        # Runs of budgets so unlike that no number of steps is in all of them have no mean.
        with contextlib.suppress(UserError):
            if len(places) > 1:
                together = [contents[index] for index in places]
                pooled.append(Pooled(tuple(places), _together(together, False), _together(together, True)))
    return pooled


def _together(contents: Sequence[RunContents], logarithmic: bool) -> Curve:
    per_seed = [rows for one in contents for rows in one.curve.per_seed]
    first = contents[0].curve
    return _curve(first.label, [one.run for one in contents], per_seed, first.score, logarithmic, None)


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
    if min(len(steps) for steps, _ in per_seed) == 0:
        raise UserError(
            f"{run.folder.metrics}: a seed has no generation yet; train longer before drawing a curve"
        )
    return _curve(label or run.algorithm.label, [run], per_seed, score, logarithmic, budget)


def _curve(
    label: str,
    runs: Sequence[Run],
    per_seed: Sequence[tuple[np.ndarray, np.ndarray]],
    score: Score,
    logarithmic: bool,
    budget: float | int | None,
) -> Curve:
    """The curve over seeds that may be of several runs."""
    band = mean_band(
        [steps for steps, _ in per_seed],
        [values for _, values in per_seed],
        window=Windows.of(budget or max(run.config.steps for run in runs)).trailing,
        lower=score.lower,
        upper=score.upper,
        logarithmic=logarithmic,
        episodes=min(run.config.score_episodes for run in runs) if score.bounded else None,
    )
    return Curve(label, band, per_seed, score=score)


def _within_budget(columns: Columns, score: Score, seed: int, budget: int) -> tuple[np.ndarray, np.ndarray]:
    rows = (columns["seed"] == seed) & (columns["environment_steps"] <= budget)
    return columns["environment_steps"][rows], columns[score.key][rows]
