"""Lets the disk fill up, or become read-only, under commands, and takes them to their end once it is mended.

    python -m benchmarks.harness.disks                              # 60 disks; needs the rights to mount one
    python -m benchmarks.harness.disks --count 6 --seed 7 --algorithms madys

Each command has a disk of its own, in memory. It has so many bytes from the start, or is filled to the last
byte at a moment drawn at random, or may no longer be written from such a moment on. The command must end in
one line of ours and exit code 2, or as if nothing had been; given again on a disk that is well, it must end
with the bits of one that was left in peace, as `benchmarks.harness.kills` has them.

Prints a row for each; the last line counts. Exits with 1 on anything else.
"""

import contextlib
import dataclasses
import os
import random
import subprocess
import sys
import tempfile
import time
from collections.abc import Generator, Sequence
from pathlib import Path

from benchmarks.harness.forks import Ended
from benchmarks.harness.options import parse_algorithms
from benchmarks.harness.references import References, activity

ALGORITHMS = ("madys", "ea", "td3", "mappo")
KINDS = ("small", "fills up", "read-only")
LARGE = 256 * 2**20
MOST_NEEDED = 3 * 2**20
"""Bytes that a small run takes, and more."""
SECONDS_TO_SHUT = 5.0
"""For which a disk is asked to become read-only: it refuses while a file is open for writing."""


@dataclasses.dataclass(frozen=True)
class Case:
    """One disk, and the command that meets it."""

    kind: str
    command: str
    algorithm: str
    share: float
    """Of the time or, for a small disk, of the bytes that the command takes."""


@contextlib.contextmanager
def disk(place: Path) -> Generator[Path]:
    """A disk in memory, mounted at an empty folder."""
    place.mkdir()
    mount(place, f"size={LARGE}")
    try:
        yield place
    finally:
        subprocess.run(["umount", "--lazy", str(place)], check=False)


def mount(place: Path, options: str) -> None:
    subprocess.run(["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(place)], check=True)


def remount(place: Path, options: str) -> bool:
    """Whether the disk took to its new options."""
    words = ["mount", "-o", f"remount,{options}", str(place)]
    return subprocess.run(words, check=False, capture_output=True).returncode == 0


def fill(place: Path, left: int = 0) -> None:
    """Leaves so many bytes free."""
    with (place / "filler").open("ab", buffering=0) as filler, contextlib.suppress(OSError):
        os.posix_fallocate(filler.fileno(), 0, max(LARGE - left, 1))
    free = os.statvfs(place)
    with (place / "filler").open("ab", buffering=0) as filler, contextlib.suppress(OSError):
        while left < free.f_bavail * free.f_bsize:
            filler.write(bytes(free.f_bsize))
            free = os.statvfs(place)


def shut(place: Path) -> None:
    """Makes a disk read-only as soon as it can be."""
    until = time.monotonic() + SECONDS_TO_SHUT
    while not remount(place, "ro") and time.monotonic() < until:
        time.sleep(0.001)


def mend(place: Path) -> None:
    """Makes it large, empty and writable again, but for what the command has written."""
    remount(place, f"rw,size={LARGE}")
    (place / "filler").unlink(missing_ok=True)


def problem_of(references: References, case: Case, place: Path) -> tuple[str, str]:
    """What was going on when the disk failed, and what went wrong, or nothing."""
    with disk(place):
        folder = place / "run"
        _, duration, _ = references.of(case.command, case.algorithm)
        words = references.words(case.command, case.algorithm, folder)
        during: list[str] = []

        def befall(_: int) -> None:
            fill(place) if case.kind == "fills up" else shut(place)
            during.append(activity(folder))

        if case.kind == "small":
            fill(place, left=int(case.share * MOST_NEEDED))
            ended = references.run(words)
        else:
            ended = references.run(words, after=case.share * duration, befall=befall)
        mend(place)
        said = f"{(during or ['-'])[0]}; exit code {ended.code}"
        return said, refused_wrongly(ended) or references.problem(case.command, case.algorithm, folder)


def refused_wrongly(ended: Ended) -> str:
    """What is wrong with how a command ended that a disk had failed, or nothing."""
    if ended.code == 0:
        return ""
    lines = ended.said.strip().splitlines() or [""]
    ours = [line for line in lines if line.startswith("skillcrew: ")]
    if ended.code != 2 or len(ours) != 1 or lines[-1] != ours[0] or "Traceback" in ended.said:
        return f"exit code {ended.code}: {ended.said[-3000:]}"
    return ""


def run_disks(place: Path, count: int, seed: int, algorithms: Sequence[str]) -> tuple[str, int]:
    """As many disks; the line that sums it up, and how many of them went wrong."""
    references, dice, wrong = References(place), random.Random(seed), 0
    served = references.serving(algorithms)
    for number in range(count):
        command = "report" if number % 6 == 5 else "train"
        case = Case(KINDS[number % len(KINDS)], command, dice.choice(served), dice.random())
        said, problem = problem_of(references, case, place / f"disk-{number}")
        wrong += bool(problem)
        what = f"{case.command} {case.algorithm}, {case.kind} at {case.share:.2f}"
        print(f"{number:>4}  {what:<36} {said:<36} {problem or 'same bits'}", flush=True)
    return f"{count} disks: {count - wrong} equal in the end, {wrong} not (seed {seed})", wrong


def main() -> int:
    arguments = parse_algorithms(__doc__, 60, ALGORITHMS)
    if os.geteuid() != 0:
        print("disks: left out, for mounting one needs the rights of root")
        return 0
    with tempfile.TemporaryDirectory(prefix="disks-") as name:
        summary, wrong = run_disks(Path(name), arguments.count, arguments.seed, arguments.algorithms)
    print(summary)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
