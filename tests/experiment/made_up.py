"""Reproductions without training: fewer runs, and run folders whose curves and scores are made up."""

import json
from collections.abc import Mapping

import numpy as np

import skillcrew as sc
from skillcrew.experiment.comparison import PlannedRun
from skillcrew.experiment.folder import RunFolder
from skillcrew.experiment.metrics import MetricsLog

EPISODES = 20
GENERATIONS = 40
METHODS = ("madys", "mfl", "ea")
FIGURES = {
    "fig-4.2": {"rover-t2-c1": {METHODS: 8000}, "rover-t2-c2": {METHODS: 6000}},
    "fig-4.3": {"rover-t3-c1": {METHODS: 9000}},
}


def shrink(monkeypatch, resamples: int = 40) -> None:
    """Three methods in two environments and in one, each of a few thousand steps; quick bootstraps."""
    monkeypatch.setattr("skillcrew.experiment.figures.FIGURES", FIGURES)
    monkeypatch.setattr("skillcrew.experiment.reproduction.LEAST_STEPS", 100)
    monkeypatch.setattr("skillcrew.analysis.comparison.RESAMPLES", resamples)


def write_run(where: RunFolder, planned: PlannedRun, heights: Mapping[int, float]) -> None:
    """A trained run without champions: each seed's success climbs over its budget to its height.

    It does so in equal generations; one more is beyond the budget and reaches 1.
    """
    assert tuple(heights) == planned.config.seeds
    where.create(planned.to_yaml())
    log = MetricsLog(planned.config.seeds)
    share = np.arange(1, GENERATIONS + 2) / GENERATIONS
    values = np.outer(list(heights.values()), share)
    values[:, -1] = 1
    log.add(
        {
            "generation": np.tile(np.arange(1, GENERATIONS + 2, dtype=np.int32), (len(heights), 1)),
            "environment_steps": np.tile(
                np.rint(share * planned.config.steps).astype(np.int32), (len(heights), 1)
            ),
            "success_rate": values.astype(np.float32),
        }
    )
    log.write(where.metrics)


def write_report(where: RunFolder, wins: Mapping[int, int]) -> None:
    """The scores of champions that won so many of `EPISODES`; each figure holds the name of its seed."""
    where.report.mkdir()
    for seed in wins:
        for kind in ("png", "pdf"):
            (where.report / f"chosen_skills_seed_{seed}.{kind}").write_text(f"{where.path} {seed} {kind}")
    returns = np.stack([np.arange(EPISODES) < won for won in wins.values()]).astype(float)
    choices = np.zeros((len(wins), EPISODES, 3, 1), int)
    evaluation = sc.Evaluation(tuple(wins), EPISODES, returns, choices, returns == 1)
    where.scores.write_text(json.dumps(evaluation.as_dict()))
