"""Kills commands at random moments, gives them once more, and compares every bit with one left in peace.

    python -m benchmarks.harness.kills                              # 200 kills
    python -m benchmarks.harness.kills --count 20 --seed 7 --algorithms madys,ea

For every algorithm a small run is trained to its end first. Then, again and again, the same is started anew
and killed with SIGKILL, at a moment drawn uniformly from the time that the first one took: between
checkpoints or in the midst of writing one (they are written as often as can be), in the report, and, where
what JAX has compiled for others is hidden from it, while it compiles. `skillcrew resume` takes it to the end;
in a third of the cases that is killed as well, once, and given again. `report` and `compare` are killed too,
and given again. The metrics, column by column, and all arrays of the final checkpoint (weights, optimisers,
keys, buffer, populations), the report's scores and the comparison's table must be those of who was left in
peace, bit for bit.

Prints a row per kill: what was killed, when, what it was doing, and the verdict; the last line counts. A
command that had ended before it could be killed is compared as well and does not count. Exits with 1 on any
difference.
"""

import dataclasses
import random
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from benchmarks.harness.options import parse_algorithms
from benchmarks.harness.references import References, activity

from skillcrew.algorithms.registry import ALGORITHMS

EVERY = {"report": 8, "compare": 20}
"""Cases between two in which that is killed instead of training."""
COLD = 0.2
"""Share of the kills in which JAX compiles all anew."""
TWICE = 1 / 3
"""Share of the kills after which the next attempt is killed too."""


@dataclasses.dataclass(frozen=True)
class Case:
    """One command to kill."""

    command: str
    algorithm: str
    first: float
    """The moment of the kill, as a share of the time that the command takes."""
    second: float | None
    """That of the next attempt; None if this is left in peace."""
    cold: bool


TOO_LATE = "nothing, it was done"


def problem_of(references: References, case: Case, folder: Path) -> tuple[str, str]:
    """What was going on at the kill, and how the end differs from an undisturbed one, or nothing."""
    command, algorithm = case.command, case.algorithm
    _, warm, cold = references.of(command, algorithm)
    duration = cold if case.cold else warm
    killed = references.run(references.words(command, algorithm, folder), case.cold, case.first * duration)
    during = activity(folder)
    if killed.code is not None:
        during = TOO_LATE
        references.took(command, algorithm, case.cold, killed.seconds)
    if case.second is not None:
        again = references.again(command, algorithm, folder)
        references.run(again, case.cold, case.second * duration)
    return during, references.problem(command, algorithm, folder)


def draw_case(number: int, algorithms: Sequence[str], dice: random.Random) -> Case:
    """The case of this number: algorithms come in turn."""
    command = next((name for name, every in EVERY.items() if number % every == every - 1), "train")
    second = dice.random() if dice.random() < TWICE else None
    algorithm = algorithms[number % len(algorithms)]
    return Case(command, algorithm, dice.random(), second, command == "train" and dice.random() < COLD)


def run_kills(place: Path, count: int, seed: int, algorithms: Sequence[str]) -> tuple[str, int]:
    """Kills so many commands; the line that sums it up, and how many ended differently.

    Raises:
        SystemExit: as many as that ended before they could be killed.
    """
    references, dice = References(place), random.Random(seed)
    served = references.serving(algorithms)
    killed = late = different = 0
    while killed < count:
        case = draw_case(killed, served, dice)
        during, problem = problem_of(references, case, place / f"case-{killed}-{late}")
        different += bool(problem)
        what = case.command if case.command == "compare" else f"{case.command} {case.algorithm}"
        twice = " and again" if case.second is not None else ""
        print(f"{killed:>4}  {what:<18} {during + twice:<32} {problem or 'same bits'}", flush=True)
        if during != TOO_LATE:
            killed += 1
        elif (late := late + 1) > count:
            raise SystemExit(f"{late} commands ended before they could be killed")
    beside = f", {late} more that came too late" if late else ""
    equal = killed + late - different
    summary = f"{killed} kills{beside}: {equal} equal, {different} different (seed {seed})"
    return summary, different


def main() -> int:
    arguments = parse_algorithms(__doc__, 200, list(ALGORITHMS))
    with tempfile.TemporaryDirectory(prefix="kills-") as name:
        summary, different = run_kills(Path(name), arguments.count, arguments.seed, arguments.algorithms)
    print(summary)
    return 1 if different else 0


if __name__ == "__main__":
    sys.exit(main())
