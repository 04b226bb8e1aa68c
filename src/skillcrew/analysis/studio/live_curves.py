"""Learning curves of chosen runs, thinned to what a browser has room for."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from skillcrew.analysis.learning import curve_over_seeds, within_budget
from skillcrew.analysis.page.panels import Curves, Line, panels, thinned
from skillcrew.analysis.studio.about import About
from skillcrew.analysis.studio.glance import Glances
from skillcrew.analysis.studio.remembered import Remembered, stamp
from skillcrew.errors import UserError, one_line
from skillcrew.experiment.folder import RunFolder
from skillcrew.experiment.score import score_among

MOST_CHOSEN = 20
"""Runs whose curves are drawn at once."""

MOST_VALUES = 20_000
"""Of a run's curves before they are averaged, over all of its seeds."""

LEAST_VALUES = 50
"""Of each seed, however many there are."""


class LiveCurves:
    """The curves of runs, each made anew only when its metrics have grown."""

    def __init__(self, glances: Glances):
        self._glances = glances
        self._lines = Remembered(3 * MOST_CHOSEN)

    def describe(self, chosen: Sequence[tuple[str, Path]]) -> dict[str, Any]:
        """Panels of curves, as the page of runs has them.

        Args:
            chosen: runs by their names; those after the first `MOST_CHOSEN` are left out.

        Returns:
            "panels", and "missing": of each run that has no curve, its name and why.
        """
        abouts, lines, missing = [], [], []
        for name, path in chosen[:MOST_CHOSEN]:
            try:
                abouts.append((name, RunFolder(path), self._glances.about(RunFolder(path))))
            except UserError as error:
                missing.append([name, str(error)])
        for name, folder, about in abouts:
            # As on the page of several runs: curves that are compared are smoothed alike.
            same = (other for _, _, other in abouts if other.environment == about.environment)
            budget = max(other.config.steps for other in same)
            line = self._line(name, folder, about, budget)
            if isinstance(line, Line):
                lines.append(line)
            else:
                missing.append([name, line])
        return {"panels": panels(dict(enumerate(lines))), "missing": missing}

    def _line(self, name: str, folder: RunFolder, about: About, budget: int) -> Line | str:
        """The curves, or why there are none."""

        def make() -> Line | str:
            try:
                return self._drawn(name, folder, about, budget)
            except UserError as error:
                return str(error)
            except Exception as error:
                # Numbers of anybody's make may be such that no mean can be made of them.
                return one_line(f"{folder.metrics}: no curve ({type(error).__name__}: {error})")

        return self._lines.get(folder.path, (stamp((folder.config, folder.metrics)), budget), make)

    def _drawn(self, name: str, folder: RunFolder, about: About, budget: int) -> Line:
        columns, seeds = self._glances.scores(folder), about.config.seeds
        if columns is None:
            raise UserError("no generation is over yet")
        score = score_among(columns)
        most = max(MOST_VALUES // len(seeds), LEAST_VALUES)
        per_seed = [
            thinned(*within_budget(columns, score, seed, about.config.steps), most=most) for seed in seeds
        ]
        if not all(len(steps) for steps, _ in per_seed):
            raise UserError("no generation of every seed is over yet")
        with np.errstate(all="ignore"):
            curves = [
                curve_over_seeds(name, [about.config], per_seed, score, logarithmic, budget)
                for logarithmic in (False, True)
            ]
        return Line(about.environment, name, Curves(*curves))
