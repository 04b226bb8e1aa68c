"""Several command lines side by side, each in a process and on processor cores of its own."""

import dataclasses
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from skillcrew.experiment.files import disk_errors
from skillcrew.experiment.interrupts import watch_interrupts

INTERRUPTED = 130

POLL_SECONDS = 0.5
START = "from skillcrew.cli.jobs import start_job; start_job()"


@dataclasses.dataclass(frozen=True)
class Job:
    """A command line of skillcrew, and the file that keeps what it says."""

    name: str
    words: tuple[str, ...]
    log: Path

    def last_line(self) -> str:
        """What it said last."""
        try:
            lines = self.log.read_text(errors="replace").splitlines()
        except OSError:
            return ""
        return next((line for line in reversed(lines) if line.strip()), "")


def run_jobs(
    jobs: Sequence[Job],
    at_once: int,
    watch: Callable[[Sequence[Job], Sequence[Job]], None],
) -> tuple[list[Job], bool]:
    """Runs jobs in their order, `at_once` of them side by side.

    A SIGINT or SIGTERM is passed on to those that run, once; each saves and ends.

    Args:
        watch: called every half a second with the jobs that run and those that have just ended.

    Returns:
        The jobs that failed, and whether an interrupt was asked for.
    """
    waiting, running, failed = list(jobs), {}, []
    shares = _shares(at_once)
    with watch_interrupts() as interrupts:
        told = False
        while running or (waiting and not interrupts.requested):
            while waiting and len(running) < at_once and not interrupts.requested:
                share = min(set(range(at_once)) - {taken for _, taken in running.values()})
                job = waiting.pop(0)
                running[job] = (_start(job, shares[share]), share)
            if interrupts.requested and not told:
                told = True
                for process, _ in running.values():
                    process.terminate()
            ended = [job for job, (process, _) in running.items() if process.poll() is not None]
            for job in ended:
                process, _ = running.pop(job)
                process.communicate()  # Closes its pipe.
                if process.returncode not in ((0, INTERRUPTED, -signal.SIGTERM) if told else (0,)):
                    failed.append(job)
            watch(list(running), ended)
            time.sleep(POLL_SECONDS)
    return failed, interrupts.requested


def start_job() -> None:
    """Entry point of a job's process: `cores word word …`, with a pipe from its parent as input."""
    from skillcrew.cli.main import run_command

    cores, *words = sys.argv[1:]
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {int(core) for core in cores.split(",")})
    # The pipe closes with the parent, however that ends: two must never train in one folder.
    threading.Thread(target=_end_with_input, daemon=True).start()
    sys.exit(run_command(words))


def _end_with_input() -> None:
    sys.stdin.read()
    os._exit(1)


def _start(job: Job, cores: tuple[int, ...]) -> subprocess.Popen:
    with disk_errors(job.log), job.log.open("a") as log:
        return subprocess.Popen(
            [sys.executable, "-c", START, ",".join(map(str, cores)), *job.words],
            stdin=subprocess.PIPE,
            stdout=log,
            stderr=subprocess.STDOUT,
            # Ctrl-C reaches the whole group of the terminal, and a second one means "do not save".
            start_new_session=True,
        )


def available_cores() -> list[int]:
    """The processor cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return sorted(os.sched_getaffinity(0))
    return list(range(os.cpu_count() or 1))


def _shares(count: int) -> list[tuple[int, ...]]:
    """The cores dealt out evenly; where there are fewer than shares, some are used twice."""
    cores = available_cores()
    return [tuple(cores[share::count]) or (cores[share % len(cores)],) for share in range(count)]
