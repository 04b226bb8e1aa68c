"""Uses skillcrew for an hour as a notebook would, in one process, and looks at what that leaves behind.

    python -m benchmarks.harness.soak                       # an hour
    python -m benchmarks.harness.soak --seconds 600 --seed 7

Small runs are trained, resumed, evaluated, shown, reported and compared in random order, and thrown away.
After each command the process is looked at: memory that it holds, open files, threads, processes that it
started. Prints a row for each; the last line says from what to what each of them grew, in the median of
the third quarter of the commands and of the last: in the first half caches fill, which have bounds. Exits
with 1 if a command failed, if files, threads or processes grew, or memory by more than 3 %.
"""

import argparse
import contextlib
import ctypes
import dataclasses
import gc
import os
import random
import shutil
import statistics
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import psutil

os.environ.setdefault("JAX_PLATFORMS", "cpu")

from benchmarks.harness.options import harness_parser
from benchmarks.harness.small_runs import OF_RUN, compare_words, train_words
from benchmarks.harness.watching import observe

ALGORITHMS = ("madys", "ea", "td3", "mappo")
SECONDS = 600
"""That a command may take."""
STEPS = OF_RUN["steps"]
MORE_MEMORY = 0.03
"""Share by which it may grow from the third quarter to the last; in an hour, a leak of 0.8 MiB a command."""


@dataclasses.dataclass(frozen=True)
class Held:
    """What the process holds."""

    memory: float
    """MiB."""
    files: int
    threads: int
    processes: int

    @classmethod
    def now(cls) -> "Held":
        gc.collect()
        # What is freed the C library keeps for the next who asks: that is no growth.
        with contextlib.suppress(OSError, AttributeError):
            ctypes.CDLL(None).malloc_trim(0)
        process = psutil.Process()
        memory = process.memory_info().rss / 2**20
        return cls(memory, process.num_fds(), process.num_threads(), len(process.children(recursive=True)))


def commands(place: Path, dice: random.Random) -> Iterator[list[str]]:
    """Command lines without end, each of which can be given once those before it have been.

    The last are as much work as the first: a run is resumed for as many steps each time, and lives no longer
    than until the fourth after it is trained.
    """
    runs: dict[Path, int] = {}
    number = 0
    while True:
        number += 1
        command = dice.choice(("train", "resume", "evaluate", "show", "report", "compare"))
        if command == "train" or not runs:
            run = place / f"run-{number}"
            runs[run] = STEPS
            yield train_words(dice.choice(ALGORITHMS), run)
        elif command == "compare":
            yield compare_words(place / f"compared-{number}")
        else:
            run = dice.choice(list(runs))
            further = []
            if command == "resume":
                runs[run] += STEPS // 4
                further = ["--steps", str(runs[run]), "--report-episodes", "20"]
            elif command != "show":
                further = ["--episodes", "20"]
            yield [command, str(run), *further]
        if len(runs) > 4:
            oldest = next(iter(runs))
            del runs[oldest]
            shutil.rmtree(oldest, ignore_errors=True)


def soak(place: Path, seconds: float, seed: int) -> tuple[list[Held], list[str]]:
    """What was held after each command, and what went wrong."""
    held, wrong, until = [], [], time.monotonic() + seconds
    for words in commands(place, random.Random(seed)):
        if time.monotonic() > until:
            return held, wrong
        outcome = observe(words, SECONDS)
        if outcome.code != 0:
            wrong.append(f"{words}: {outcome}")
            print(wrong[-1], flush=True)
        held.append(Held.now())
        print(f"{len(held):>5}  {words[0]:<9} {held[-1]}", flush=True)
    return held, wrong


def growth(held: Sequence[Held]) -> dict[str, tuple[float, float]]:
    """The median of each in the third quarter and in the last."""
    quarter = max(len(held) // 4, 1)
    early, late = held[-2 * quarter : -quarter] or held, held[-quarter:]
    return {
        field.name: (
            statistics.median(getattr(one, field.name) for one in early),
            statistics.median(getattr(one, field.name) for one in late),
        )
        for field in dataclasses.fields(Held)
    }


def is_flat(grown: dict[str, tuple[float, float]]) -> bool:
    """Whether nothing grew but memory, and that no more than it may."""
    allowed = {"memory": 1 + MORE_MEMORY}
    return all(late <= early * allowed.get(name, 1) for name, (early, late) in grown.items())


def main() -> int:
    arguments = parse_arguments()
    with tempfile.TemporaryDirectory(prefix="soak-") as name:
        held, wrong = soak(Path(name), arguments.seconds, arguments.seed)
    grown = growth(held)
    said = ", ".join(f"{name} {early:.0f} to {late:.0f}" for name, (early, late) in grown.items())
    print(f"{len(held)} commands, {len(wrong)} failed: {said} (seed {arguments.seed})")
    return int(bool(wrong) or not is_flat(grown))


def parse_arguments() -> argparse.Namespace:
    parser = harness_parser(__doc__)
    parser.add_argument("--seconds", type=float, default=3600, help="how long (default: 3600)")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
