"""The thesis's experiments as a list of runs, and the folder that they go into."""

import dataclasses
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml

from skillcrew.algorithms.algorithm import Algorithm
from skillcrew.algorithms.registry import make_algorithm
from skillcrew.envs.presets import make
from skillcrew.errors import UserError, unknown_name
from skillcrew.experiment.config import RunConfig, to_yaml
from skillcrew.experiment.files import disk_errors, write_whole
from skillcrew.experiment.folder import RunFolder

FORMAT = 1
"""Version of the folder's layout; another one is refused."""

FIGURES: Mapping[str, tuple[str, ...]] = {
    "fig-4.2": ("rover-t2-c1", "rover-t2-c2", "rover-t2-c3"),
    "fig-4.3": ("rover-t3-c1", "rover-t3-c2", "rover-t3-c3"),
}
"""The thesis's figures, and the environments that they show."""

METHODS: Mapping[str, str] = {"madys": "MADyS", "mfl": "MFL", "ea": "EA", "madys-plus": "MADyS+"}
"""Algorithms that are compared, and what figures and tables call them. The first three have the thesis's
form: feed-forward networks, one for each agent."""

STEPS: Mapping[str, int] = {
    "rover-t2-c1": 6_000_000,
    "rover-t2-c2": 16_000_000,
    "rover-t2-c3": 12_000_000,
    "rover-t3-c1": 24_000_000,
    "rover-t3-c2": 32_000_000,
    "rover-t3-c3": 40_000_000,
}
"""Environment steps per seed, the same for all methods."""

LEAST_STEPS = 200_000
"""Whatever the budget, so that every method lives more than one generation: one takes up to 100,000 steps."""

SEEDS = (2000, 2001, 2002, 2003, 2004)
"""The thesis's five."""

EXPLANATION = """\
This folder reproduces figures of the MADyS thesis with skillcrew.

table.md, table.csv     every method in every environment: steps to 0.5 and 0.9, final success, area, ...
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
    """A key of `METHODS`."""
    algorithm: Algorithm
    config: RunConfig

    @property
    def name(self) -> str:
        return f"{self.environment}-{self.method}"

    def to_yaml(self) -> str:
        """Its whole configuration."""
        return to_yaml(self.algorithm, self.config)


def figures_of(name: str) -> tuple[str, ...]:
    """The figures that a name stands for: one of `FIGURES`, `all` of them, or a single environment's panel.

    Raises:
        UserError: an unknown name.
    """
    if name == "all":
        return tuple(FIGURES)
    if name not in FIGURES and name not in STEPS:
        raise unknown_name("figure", name, (*FIGURES, "all", *STEPS))
    return (name,)


def environments_of(figure: str) -> tuple[str, ...]:
    """What a figure shows, a panel each; an environment's name is the figure of its panel alone."""
    return FIGURES.get(figure, (figure,))


def plan(figures: Sequence[str], seeds: tuple[int, ...] = SEEDS, budget: float = 1.0) -> list[PlannedRun]:
    """The runs behind some figures.

    Args:
        budget: share of the full number of environment steps (but see `LEAST_STEPS`), and of the time that
            skills are given to learn: MFL's pre-training, and the generations of the plateau rule.

    Raises:
        UserError: a budget that is not a share above 0.
    """
    if not 0 < budget <= 1:
        raise UserError(f"--budget {budget}: give a share above 0 and up to 1, such as 0.02")
    return [
        _planned(environment, method, seeds, budget)
        for figure in figures
        for environment in environments_of(figure)
        for method in METHODS
    ]


def _planned(environment: str, method: str, seeds: tuple[int, ...], budget: float) -> PlannedRun:
    algorithm = make_algorithm(method, make(environment))
    shortened = _shortened(algorithm.config, budget)
    steps = max(LEAST_STEPS, round(budget * STEPS[environment]))
    return PlannedRun(
        environment,
        method,
        make_algorithm(method, algorithm.env, shortened),
        RunConfig(seeds=seeds, steps=steps),
    )


def _shortened(config: Any, budget: float) -> Any:
    """An algorithm's configuration with all that takes time before the search begins in earnest cut down.

    Gradients are nine tenths of what a run costs while skills learn, more than a quick look can afford.
    """

    def share(whole: int) -> int:
        return max(1, round(budget * whole))

    changes: dict[str, Any] = {}
    if hasattr(config, "pretraining_steps"):
        changes["pretraining_steps"] = share(config.pretraining_steps)
    if hasattr(config, "plateau"):
        plateau = config.plateau
        longest = plateau.earliest + plateau.window
        # A skill learns no more in the generation in which it stops.
        latest = share(longest) + 1 if budget < 1 else None
        changes["plateau"] = dataclasses.replace(plateau, latest=latest)
    return dataclasses.replace(config, **changes)


class ReproductionFolder:
    """Where the runs of a reproduction and what is made of them are."""

    def __init__(self, path: Path | str):
        self.path = Path(path)
        self.about = self.path / "reproduction.json"
        self.figures = self.path / "figures"
        self.configurations = self.path / "configurations"

    def run(self, planned: PlannedRun) -> RunFolder:
        """The folder of one run."""
        return RunFolder(self.path / "runs" / planned.environment / planned.method)

    def log(self, planned: PlannedRun) -> Path:
        """What one run says."""
        return self.path / "logs" / f"{planned.name}.log"

    def open(self) -> None:
        """Makes the folder, or checks that it is one of ours.

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
        write_whole(self.path / "README.txt", lambda path: path.write_text(EXPLANATION))

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
            about = json.loads(self.about.read_text())
        except (OSError, ValueError):
            about = None
        found = about.get("format") if isinstance(about, dict) else None
        if found != FORMAT:
            raise UserError(
                f"{self.about}: of another version (format {found!r}, this skillcrew writes {FORMAT}); "
                "choose another folder with --out, or use the skillcrew that made it"
            )

    def _check_same(self, folder: RunFolder, planned: PlannedRun) -> None:
        try:
            found = yaml.safe_load(folder.config.read_text())
        except (OSError, UnicodeDecodeError, yaml.YAMLError):
            found = None
        if not isinstance(found, dict):
            raise UserError(f"{folder.config}: damaged; move {folder.path} away to train that run anew")
        difference = first_difference(found, yaml.safe_load(planned.to_yaml()))
        if difference is not None:
            field, there, asked = difference
            raise UserError(
                f"{folder.config}: {field} is {there!r} there and {asked!r} is asked for; go on with the "
                f"options that it was begun with, or choose another folder with --out"
            )


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
