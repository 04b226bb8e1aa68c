"""What a comparison ends in: figures, tables, and copies of what each run was made with."""

import dataclasses
import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np

from skillcrew.analysis.canvas import save
from skillcrew.analysis.comparison import area_under_curve
from skillcrew.analysis.curves import Curve, panels_of_curves
from skillcrew.analysis.learning import learning_curve
from skillcrew.analysis.levels import Windows, reaching
from skillcrew.analysis.tables import Entry, write_tables
from skillcrew.errors import UserError
from skillcrew.experiment.comparison import Comparison, ComparisonFolder, PlannedRun
from skillcrew.experiment.files import read_plain, write_whole
from skillcrew.experiment.folder import RunFolder, describe_environment
from skillcrew.experiment.run import Run
from skillcrew.experiment.score import score_of


def write_results(folder: ComparisonFolder, comparison: Comparison) -> list[Path]:
    """Draws the figures and writes the tables of runs that are all done.

    Returns:
        The files written, those to look at first before the others.
    """
    runs = comparison.runs
    horizons = {one.name: comparison.horizon(one.environment) for one in runs}
    curves = {one.name: _curve(folder.run(one), one, horizons[one.name]) for one in runs}
    written = []
    for figure in comparison.figures:
        panels = {
            environment: [curves[one.name] for one in runs if one.environment == environment]
            for environment in figure.environments
        }
        written += save(panels_of_curves(panels, figure.title), folder.figures / figure.name)
    entries = [_entry(folder.run(one), one, curves[one.name], horizons[one.name]) for one in runs]
    written += write_tables(folder.path, entries)
    for one in runs:
        written += _copy_skills(folder, one)
        text = one.to_yaml()
        configuration = folder.configurations / f"{one.name}.yaml"
        write_whole(configuration, lambda path, text=text: path.write_text(text))
    environment = folder.path / "environment.txt"
    write_whole(environment, lambda path: path.write_text(describe_environment()))
    return [*written, folder.configurations, environment]


def _curve(where: RunFolder, planned: PlannedRun, horizon: int) -> Curve:
    run = Run(where.path, planned.algorithm.env)
    curve = learning_curve(run, planned.label, logarithmic=True, budget=horizon)
    return dataclasses.replace(
        curve, pretrained_at=getattr(planned.algorithm.config, "pretraining_steps", None)
    )


def _entry(where: RunFolder, planned: PlannedRun, curve: Curve, horizon: int) -> Entry:
    """What one run reached; `horizon`: environment steps that all methods of its environment had."""
    score, budget = score_of(planned.algorithm.env), planned.config.steps
    scores, episodes = _scores(where, planned)
    return Entry(
        environment=planned.environment,
        method=planned.label,
        seeds=planned.config.seeds,
        steps=planned.config.steps,
        final=np.array([seed["mean"] for seed in scores]),
        episodes=episodes,
        area=np.array([area_under_curve(*seed, horizon, score.start) for seed in curve.per_seed]),
        steps_to={
            level: [reaching(*seed, level, Windows.of(horizon), budget) for seed in curve.per_seed]
            for level in score.thresholds
        },
        score=score,
    )


def _copy_skills(folder: ComparisonFolder, planned: PlannedRun) -> list[Path]:
    """The chosen skills of the seed with the median score, where there is something to choose."""
    if len(planned.algorithm.choices()) < 2:
        return []
    scores = sorted(_scores(folder.run(planned), planned)[0], key=lambda seed: (seed["mean"], seed["seed"]))
    median = scores[len(scores) // 2]["seed"]
    copies = []
    for kind in ("png", "pdf"):
        source = folder.run(planned).report / f"chosen_skills_seed_{median}.{kind}"
        if not source.is_file():
            raise UserError(
                f"{source}: missing; `skillcrew resume {folder.run(planned).path}` draws it again"
            )
        copy = folder.figures / f"skills-{planned.name}.{kind}"
        write_whole(copy, lambda path, source=source: shutil.copyfile(source, path))
        copies.append(copy)
    return copies


def _scores(where: RunFolder, planned: PlannedRun) -> tuple[list[dict[str, Any]], int]:
    """What each seed's champion reached, and on how many episodes."""
    key = score_of(planned.algorithm.env).key
    try:
        found = json.loads(read_plain(where.scores))
        return found[key]["per_seed"], int(found["episodes"])
    except (OSError, ValueError, RecursionError, KeyError, TypeError):
        raise UserError(
            f"{where.scores}: missing or damaged; `skillcrew resume {where.path}` scores the champions again"
        ) from None
