"""Trains the runs of a comparison side by side, whatever is missing of them, and ends in its results."""

import shlex
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import jax
from rich.console import Console

from skillcrew.analysis.comparison_report import write_results
from skillcrew.cli.arguments import format_trackers
from skillcrew.cli.jobs import Job, available_cores, run_jobs
from skillcrew.errors import UserError
from skillcrew.experiment.comparison import Comparison, ComparisonFolder, PlannedRun
from skillcrew.experiment.device_memory import available, in_gib
from skillcrew.experiment.files import write_whole
from skillcrew.experiment.memory import estimate
from skillcrew.experiment.progress import clock

STATUS_SECONDS = 60.0
"""Time between two rounds of lines about what runs."""


def run_side_by_side(
    comparison: Comparison,
    out: Path,
    jobs: int | None,
    words: Sequence[str],
    *,
    so_far: bool = False,
    trust: bool = False,
) -> int:
    """Trains what is missing in a folder, then writes figures and tables.

    Args:
        jobs: runs at a time; None for as many as there are cores and memory for.
        so_far: whether to train nothing, and write what the finished runs say.
        words: the command line that goes on with it.
        trust: whether the command line named code of its own, such as the environment by its import path.

    Returns:
        The exit code: 0, or 130 if interrupted after saving.

    Raises:
        UserError: not a number of jobs, a folder that holds something else, a run that failed, or nothing
            that is finished so far.
    """
    if jobs is not None and jobs < 1:
        raise UserError(f"--jobs {jobs}: give at least 1")
    folder = ComparisonFolder(out)
    if so_far and not folder.about.exists():
        raise _nothing_so_far(comparison, out)
    folder.open(comparison.purpose, comparison.score)
    missing = [one for one in comparison.runs if not folder.is_done(one)]
    if so_far:
        comparison = _finished(comparison, missing, out)
    elif missing:
        at_once = _jobs_at_once(jobs, missing)
        again = f"`skillcrew {shlex.join(words)}`"
        if not _train(missing, folder, at_once, len(comparison.runs), again, trust):
            return 130
    for path in write_results(folder, comparison):
        print(path)
    return 0


def _finished(comparison: Comparison, missing: list[PlannedRun], out: Path) -> Comparison:
    """What is done, where that is anything."""
    done = [one for one in comparison.runs if one not in missing]
    if not done:
        raise _nothing_so_far(comparison, out)
    print(f"{len(done)} of {len(comparison.runs)} runs are finished.", file=sys.stderr)
    return comparison.only(done)


def _nothing_so_far(comparison: Comparison, out: Path) -> UserError:
    return UserError(
        f"--so-far: none of {len(comparison.runs)} runs is finished in {out}; train them without it"
    )


def _train(
    missing: list[PlannedRun], folder: ComparisonFolder, at_once: int, total: int, again: str, trust: bool
) -> bool:
    """Trains runs side by side; False if interrupted."""
    # The longest first, so that none is left to run alone in the end.
    missing = sorted(missing, key=_cost, reverse=True)
    watch = _Watch(total, len(missing))
    watch.say(f"{total} runs: {total - len(missing)} done, {len(missing)} to train, {at_once} at a time.")
    failed, interrupted = run_jobs([_job(one, folder, trust) for one in missing], at_once, watch)
    if failed:
        raise UserError(
            f"{failed[0].name} failed: {failed[0].last_line()} (all it said is in {failed[0].log}); mend "
            f"that, then {again} goes on"
        )
    if interrupted:
        print(f"Interrupted and saved. {again} goes on.", file=sys.stderr)
    return not interrupted


def _job(planned: PlannedRun, folder: ComparisonFolder, trust: bool) -> Job:
    """Begins a run, or goes on with it."""
    where = folder.run(planned)
    if where.path.exists():
        trackers = format_trackers(planned.config.trackers)
        words = ("resume", str(where.path), "--trackers", trackers)
    else:
        text = planned.to_yaml()
        config = folder.configurations / f"{planned.name}.yaml"
        write_whole(config, lambda path: path.write_text(text))
        where.path.parent.mkdir(parents=True, exist_ok=True)
        words = ("train", "--config", str(config), "--out", str(where.path))
    return Job(planned.name, (*words, "--trust") if trust else words, folder.log(planned))


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
