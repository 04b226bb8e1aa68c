"""Uses skillcrew for an hour as a notebook would, in one process, and looks at what that leaves behind.

    python -m benchmarks.harness.soak                       # an hour
    python -m benchmarks.harness.soak --seconds 600 --seed 7

Small runs are trained, resumed, evaluated, shown, reported and compared in random order, and thrown away.
After each command the process is looked at: memory that it holds, open files, threads, processes that it
started. Prints a row now and then; the last line says from what to what each of them grew, in the median of
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
from benchmarks.harness.small_runs import compare_words, train_words
from benchmarks.harness.watching import observe

ALGORITHMS = ("madys", "ea", "td3", "mappo")
SECONDS = 600
"""That a command may take."""
ROW_EVERY = 20
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
    """Command lines without end, each of which can be given once those before it have been."""
    runs: list[Path] = []
    number = 0
    while True:
        number += 1
        command = dice.choice(("train", "resume", "evaluate", "show", "report", "compare"))
        if command == "train" or not runs:
            runs.append(place / f"run-{number}")
            yield train_words(dice.choice(ALGORITHMS), runs[-1])
        elif command == "compare":
            yield compare_words(place / f"compared-{number}")
        else:
            further = {"resume": ["--steps", str(2000 + 100 * number), "--report-episodes", "20"]}
            episodes = {name: ["--episodes", "20"] for name in ("evaluate", "report")}
            yield [command, str(dice.choice(runs)), *{**further, **episodes}.get(command, [])]
        if len(runs) > 4:
            shutil.rmtree(runs.pop(0), ignore_errors=True)


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
        if len(held) % ROW_EVERY == 1:
            print(f"{len(held):>5}  {held[-1]}", flush=True)
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
