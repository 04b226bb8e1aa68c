"""`skillcrew reproduce FIGURE`."""

import dataclasses
import shlex
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import jax
from rich.console import Console

from skillcrew.analysis.reproduction_report import write_results
from skillcrew.cli.arguments import Seeds
from skillcrew.cli.jobs import Job, available_cores, run_jobs
from skillcrew.cli.options import parse_options
from skillcrew.cli.present import take_places
from skillcrew.errors import UserError
from skillcrew.experiment import reproduction
from skillcrew.experiment.files import write_whole
from skillcrew.experiment.memory import available, estimate, in_gib
from skillcrew.experiment.progress import clock
from skillcrew.experiment.reproduction import PlannedRun, ReproductionFolder

USAGE = (
    "usage: skillcrew reproduce FIGURE [OPTIONS]\n\n"
    f"FIGURE  {', '.join(reproduction.FIGURES)}, or all; or one environment of theirs:\n"
    f"        {', '.join(reproduction.STEPS)}\n\n"
    "Trains what the MADyS thesis compares (MADyS, MFL and EA in its form, and MADyS in our best form) with\n"
    "its five seeds, and ends in its figures, a table, and every run's configuration. Can be interrupted at\n"
    "any time: the same command goes on where it was."
)

DEFAULT_SEEDS = Seeds(reproduction.SEEDS)

STATUS_SECONDS = 60.0
"""Time between two rounds of lines about what runs."""


@dataclasses.dataclass(frozen=True)
class ReproduceOptions:
    """Options of `skillcrew reproduce`."""

    out: Path = Path("runs/reproduction")
    """Folder for runs and results; one that was begun is gone on with."""
    budget: float = 1.0
    """Share of the full number of environment steps, and of the time that skills are given to learn: 0.02 for
    a quick look, whose figures mean nothing."""
    seeds: Seeds = DEFAULT_SEEDS
    """How many runs (5: seeds 0 to 4), or which (2000..2004); all in one program."""
    jobs: int | None = None
    """Runs side by side, each on its share of the cores. Default: one per core, or one on a GPU."""


def run(words: list[str]) -> int:
    """Trains what is missing, then writes figures and tables; 130 if interrupted after saving."""
    places = take_places(words, ("FIGURE",), USAGE)
    if places is None:
        parse_options(ReproduceOptions, ["--help"], ReproduceOptions(), "skillcrew reproduce FIGURE", USAGE)
        return 0
    figures = reproduction.figures_of(places[0])
    options = parse_options(
        ReproduceOptions, words[1:], ReproduceOptions(), f"skillcrew reproduce {places[0]}", USAGE
    )
    planned = reproduction.plan(figures, tuple(options.seeds), options.budget)
    folder = ReproductionFolder(options.out)
    if options.jobs is not None and options.jobs < 1:
        raise UserError(f"--jobs {options.jobs}: give at least 1")
    folder.open()
    missing = [one for one in planned if not folder.is_done(one)]
    again = f"`skillcrew reproduce {shlex.join(words)}`"
    if missing:
        at_once = _jobs_at_once(options.jobs, missing)
        if not _train(missing, folder, at_once, len(planned), again):
            return 130
    for path in write_results(folder, figures, planned):
        print(path)
    return 0


def _train(
    missing: list[PlannedRun], folder: ReproductionFolder, at_once: int, total: int, again: str
) -> bool:
    """Trains runs side by side; False if interrupted."""
    # The longest first, so that none is left to run alone in the end.
    missing = sorted(missing, key=_cost, reverse=True)
    watch = _Watch(total, len(missing))
    watch.say(f"{total} runs: {total - len(missing)} done, {len(missing)} to train, {at_once} at a time.")
    failed, interrupted = run_jobs([_job(one, folder) for one in missing], at_once, watch)
    if failed:
        raise UserError(
            f"{failed[0].name} failed: {failed[0].last_line()} (all it said is in {failed[0].log}); mend "
            f"that, then {again} goes on"
        )
    if interrupted:
        print(f"Interrupted and saved. {again} goes on.", file=sys.stderr)
    return not interrupted


def _job(planned: PlannedRun, folder: ReproductionFolder) -> Job:
    """Begins a run, or goes on with it."""
    where = folder.run(planned)
    if where.path.exists():
        words = ("resume", str(where.path))
    else:
        text = planned.to_yaml()
        config = folder.configurations / f"{planned.name}.yaml"
        write_whole(config, lambda path: path.write_text(text))
        where.path.parent.mkdir(parents=True, exist_ok=True)
        words = ("train", "--config", str(config), "--out", str(where.path))
    return Job(planned.name, words, folder.log(planned))


def _cost(planned: PlannedRun) -> int:
    return planned.config.steps * planned.algorithm.env.n_agents


def _jobs_at_once(asked: int | None, planned: Sequence[PlannedRun]) -> int:
    """As many as asked for, or as there are cores and memory for."""
    if asked is not None:
        return asked
    if jax.default_backend() != "cpu":
        return 1
    largest = max(estimate(one.algorithm, one.config) for one in planned)
    fit = available() // largest
    if fit < 1:
        raise UserError(
            f"the largest run needs about {in_gib(largest)} and the machine has {in_gib(available())} free; "
            "give fewer --seeds"
        )
    return min(fit, len(planned), len(available_cores()))


class _Watch:
    """Says what has begun and ended, and now and then what runs."""

    def __init__(self, total: int, missing: int):
        self._console = Console(stderr=True)
        self._total, self._done = total, total - missing
        self._begun: dict[Job, float] = {}
        self._last = time.monotonic()

    def say(self, line: str) -> None:
        self._console.print(line, soft_wrap=True, highlight=False, markup=False)

    def __call__(self, running: Sequence[Job], ended: Sequence[Job]) -> None:
        now = time.monotonic()
        for job in running:
            if job not in self._begun:
                self._begun[job] = now
                self.say(f"{job.name} begins")
        for job in ended:
            self._done += 1
            took = clock(now - self._begun.get(job, now))
            self.say(f"[{self._done}/{self._total}] {job.name} ended after {took}: {job.last_line()}")
        if now - self._last >= STATUS_SECONDS:
            self._last = now
            for job in running:
                self.say(f"  {job.name}: {job.last_line()}")
