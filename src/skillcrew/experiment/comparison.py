"""Several algorithms side by side: their runs, and the folder that these go into."""

import dataclasses
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import yaml

from skillcrew.algorithms.algorithm import Algorithm
from skillcrew.errors import UserError
from skillcrew.experiment.config import OF_SESSION, RunConfig, to_yaml
from skillcrew.experiment.files import disk_errors, read_plain, write_whole
from skillcrew.experiment.folder import RunFolder
from skillcrew.experiment.score import SUCCESS, Score, score_of
from skillcrew.experiment.yaml_files import read_yaml

FORMAT = 1
"""Version of the folder's layout; another one is refused."""

EXPLANATION = """\
{purpose}

table.md, table.csv     every method in every environment: {measures}, area, ...
figures/                learning curves with 95 % intervals, and who chose which skill when
configurations/         every option of every run; `skillcrew train --config` takes each
environment.txt         versions, machine and command
runs/                   the runs themselves, each a folder that explains itself
logs/                   what each run said

The same command goes on where it was interrupted.
"""


@dataclasses.dataclass(frozen=True)
class PlannedRun:
    """One method in one environment, all seeds in one program."""

    environment: str
    method: str
    """What files and folders call it."""
    label: str
    """What figures and tables call it."""
    algorithm: Algorithm
    config: RunConfig
    """Its own seeds and budget: methods of one environment may be given different numbers of steps."""

    @property
    def name(self) -> str:
        return f"{self.environment}-{self.method}"

    def to_yaml(self) -> str:
        """Its whole configuration."""
        return to_yaml(self.algorithm, self.config)


@dataclasses.dataclass(frozen=True)
class Comparison:
    """What is to be run and drawn."""

    purpose: str
    """A sentence on what the folder is for."""
    runs: Sequence[PlannedRun]
    figures: Sequence["ComparedFigure"]

    @property
    def score(self) -> Score:
        """What methods are compared by.

        Raises:
            UserError: environments that score teams otherwise; no table could say who is ahead.
        """
        first, *others = dict.fromkeys(score_of(one.algorithm.env) for one in self.runs)
        if others:
            raise UserError(
                "runs: some environments say what success is (Environment.success) and others do not; "
                "compare them apart"
            )
        return first

    def only(self, runs: Sequence[PlannedRun]) -> "Comparison":
        """What some of the runs say by themselves."""
        left = {one.environment for one in runs}
        shown = [
            dataclasses.replace(
                figure, environments=tuple(name for name in figure.environments if name in left)
            )
            for figure in self.figures
        ]
        return Comparison(self.purpose, runs, [figure for figure in shown if figure.environments])

    def horizon(self, environment: str) -> int:
        """Environment steps per seed that all methods of an environment were given: the smallest budget."""
        return min(one.config.steps for one in self.runs if one.environment == environment)


@dataclasses.dataclass(frozen=True)
class ComparedFigure:
    """A figure with a panel for each of some environments."""

    name: str
    """Of its files."""
    title: str
    environments: tuple[str, ...]


class ComparisonFolder:
    """Where the runs of a comparison and what is made of them are."""

    def __init__(self, path: Path | str):
        self.path = Path(path)
        self.about = self.path / "comparison.json"
        self.figures = self.path / "figures"
        self.configurations = self.path / "configurations"

    def run(self, planned: PlannedRun) -> RunFolder:
        """The folder of one run."""
        return RunFolder(self.path / "runs" / planned.environment / planned.method)

    def log(self, planned: PlannedRun) -> Path:
        """What one run says."""
        return self.path / "logs" / f"{planned.name}.log"

    def open(self, purpose: str, score: Score = SUCCESS) -> None:
        """Makes the folder, or checks that it is one of ours.

        Args:
            purpose: a sentence on what it is for.
            score: what its tables compare methods by.

        Raises:
            UserError: the folder holds something else, is of another version, or cannot be written.
        """
        with disk_errors(self.path):
            if self.about.is_file():
                self._check_version()
            elif self.path.exists() and any(self.path.iterdir()):
                raise UserError(f"{self.path}: holds something else; choose another folder with --out")
            else:
                self.path.mkdir(parents=True, exist_ok=True)
                text = json.dumps({"format": FORMAT}) + "\n"
                # The first file: whatever happens from now on, the folder is known as one of ours.
                write_whole(self.about, lambda path: path.write_text(text))
            for folder in (self.path / "logs", self.path / "runs", self.figures, self.configurations):
                folder.mkdir(exist_ok=True)
        explanation = self.path / "README.txt"
        if not explanation.exists():
            reached = " and ".join(f"{threshold:g}" for threshold in score.thresholds)
            measures = f"steps to {reached}, final {score.word}" if reached else f"final {score.word}"
            text = EXPLANATION.format(purpose=purpose, measures=measures)
            write_whole(explanation, lambda path: path.write_text(text))

    def is_done(self, planned: PlannedRun) -> bool:
        """Whether a run has been trained and scored.

        Raises:
            UserError: it exists with another configuration than what is asked for.
        """
        folder = self.run(planned)
        if not folder.path.exists():
            return False
        folder.check_is_run()
        self._check_same(folder, planned)
        return folder.scores.is_file()

    def _check_version(self) -> None:
        try:
            about = json.loads(read_plain(self.about))
        except (OSError, ValueError, RecursionError):
            about = None
        found = about.get("format") if isinstance(about, dict) else None
        if found != FORMAT:
            raise UserError(
                f"{self.about}: of another version (format {found!r}, this skillcrew writes {FORMAT}); "
                "choose another folder with --out, or use the skillcrew that made it"
            )

    def _check_same(self, folder: RunFolder, planned: PlannedRun) -> None:
        try:
            found = read_yaml(folder.config)
        except UserError:
            found = None
        if not isinstance(found, dict):
            raise UserError(f"{folder.config}: damaged; move {folder.path} away to train that run anew")
        difference = first_difference(_lasting(found), _lasting(yaml.safe_load(planned.to_yaml())))
        if difference is not None:
            field, there, asked = difference
            raise UserError(
                f"{folder.config}: {field} is {there!r} there and {asked!r} is asked for; go on with the "
                f"options that it was begun with, or choose another folder with --out"
            )


def _lasting(sections: dict[str, Any]) -> dict[str, Any]:
    """A configuration without what may differ from session to session."""
    run = sections.get("run")
    if not isinstance(run, dict):
        return sections
    return {**sections, "run": {name: value for name, value in run.items() if name not in OF_SESSION}}


def first_difference(found: Any, asked: Any, place: str = "") -> tuple[str, Any, Any] | None:
    """The first field in which two nested configurations differ, and its two values."""
    if isinstance(found, dict) and isinstance(asked, dict):
        for name in [*asked, *(name for name in found if name not in asked)]:
            inner = f"{place}.{name}" if place else str(name)
            difference = first_difference(found.get(name), asked.get(name), inner)
            if difference is not None:
                return difference
        return None
    return None if found == asked else (place or "the configuration", found, asked)
