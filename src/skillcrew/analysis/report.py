"""The report of a run: its learning curve, who chose which skill when, and the page that shows all of it."""

import contextlib
import itertools
import json
import textwrap
import warnings
from collections.abc import Sequence
from pathlib import Path

from skillcrew.analysis.canvas import save
from skillcrew.analysis.curves import Curve, learning_curves
from skillcrew.analysis.learning import curve_over_seeds, learning_curve
from skillcrew.analysis.page.contents import Pooled, RunContents
from skillcrew.analysis.page.panels import Curves
from skillcrew.analysis.page.write import write_page
from skillcrew.analysis.skill_figures import skill_distribution
from skillcrew.analysis.statistics import NoCurve
from skillcrew.errors import Notice, UserError
from skillcrew.experiment.evaluation import Evaluation
from skillcrew.experiment.files import write_whole
from skillcrew.experiment.recording import shown_episodes
from skillcrew.experiment.run import Run
from skillcrew.experiment.score import RETURN

PAGE = "report.html"
CURVE = "learning_curve"

WIDEST_LINE = 68
"""Letters that fit above the axes."""


def write_report(run: Run, evaluation: Evaluation, folder: Path | None = None) -> list[Path]:
    """Draws the learning curve over all seeds and each seed's chosen skills; writes the page and the scores.

    The chosen skills are those that the champions really chose in the episodes of `evaluation`. Where metrics
    are lost there is no curve, and a notice says so.

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
    title, written = _title(run), []
    try:
        written += save(learning_curves([learning_curve(run)], _title_of_curve(run)), folder / CURVE)
    except NoCurve as error:
        warnings.warn(Notice(f"a report without a learning curve: {error}"), stacklevel=2)
    for seed, choices, reached in zip(evaluation.seeds, evaluation.choices, evaluation.per_seed, strict=True):
        heading = f"{title}, seed {seed}: {_said(evaluation, reached.mean)}"
        figure = skill_distribution(choices, run.algorithm.choices(), heading)
        written += save(figure, folder / _skills_of(seed))
    scores = json.dumps(evaluation.as_dict(), indent=1) + "\n"
    scores_file = folder / run.folder.scores.name
    write_whole(scores_file, lambda path: path.write_text(scores))
    return [*written, scores_file]


def seed_figures(run: Run) -> dict[int, dict[str, Path]]:
    """The figures that `write_report` drew last, as PNG: for each seed, by name."""
    folder = run.folder.report
    found = {}
    for seed in run.config.seeds:
        stems = {"learning_curve": CURVE, "chosen_skills": _skills_of(seed)}
        figures = {name: folder / f"{stem}.png" for name, stem in stems.items()}
        found[seed] = {name: path for name, path in figures.items() if path.exists()}
    return found


def _skills_of(seed: int) -> str:
    return f"chosen_skills_seed_{seed}"


def _title(run: Run) -> str:
    return f"{run.algorithm.label} on {run.algorithm.env.name}"


def _title_of_curve(run: Run) -> str:
    """The same, and below it what the run began with, whose steps the curve does not show."""
    below = [part for line in run.config.origins() for part in textwrap.wrap(line, WIDEST_LINE)]
    # Between two dollars matplotlib reads mathematics, and a folder may be called anything.
    return "\n".join([_title(run), *(part.replace("$", r"\$") for part in below)])


def _contents(run: Run, evaluation: Evaluation, name: str, budget: int) -> RunContents:
    curves = None
    with contextlib.suppress(NoCurve):
        curve, logarithmic = (learning_curve(run, logarithmic=axis, budget=budget) for axis in (False, True))
        curves = Curves(curve, logarithmic)
    return RunContents(run, name, evaluation, curves, shown_episodes(run))


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
        if one.curves is not None:
            key = algorithm.label, algorithm.env.name, one.curves.even.score.key
            groups.setdefault(key, []).append(index)
    pooled = []
    for places in groups.values():
        # Runs of budgets so unlike that no number of steps is in all of them have no mean.
        with contextlib.suppress(UserError):
            if len(places) > 1:
                together = [contents[index] for index in places]
                curves = Curves(_together(together, False), _together(together, True))
                pooled.append(Pooled(tuple(places), curves))
    return pooled


def _together(contents: Sequence[RunContents], logarithmic: bool) -> Curve:
    curves = [one.curves.even for one in contents if one.curves is not None]
    per_seed, first = [rows for curve in curves for rows in curve.per_seed], curves[0]
    return curve_over_seeds(
        first.label, [one.run.config for one in contents], per_seed, first.score, logarithmic, None
    )


def _said(evaluation: Evaluation, mean: float) -> str:
    if evaluation.completed is None:
        return f"mean return {RETURN.number(mean)} in {evaluation.episodes} episodes"
    return f"{mean:.1%} of {evaluation.episodes} episodes solved"
