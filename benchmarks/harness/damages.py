"""Damages a file of a run folder, again and again, and looks at what the commands make of it.

    python -m benchmarks.harness.damages                       # 500 damages
    python -m benchmarks.harness.damages --count 20 --seed 7

A tiny run is trained to its end first. For each case one of its files is damaged (a bit flipped, cut off, its
tail zeroed, emptied, deleted), and `evaluate --json`, `report` and `resume`, within the budget and beyond it,
are run on a copy each. Each must end as without the damage, to the bit; or in a refusal, one line that names
what is damaged and leaves the folder as it was; or say that the checkpoint before is used, and end as there.

Anything else is printed, with the damage; the last line counts. Exits with 1 if there is any.
"""

import argparse
import collections
import contextlib
import dataclasses
import functools
import os
import random
import re
import shutil
import sys
import tempfile
from collections.abc import Collection, Generator, Mapping
from pathlib import Path
from unittest import mock

import numpy as np

os.environ.setdefault("JAX_PLATFORMS", "cpu")

from benchmarks.harness.endings import ending, same
from benchmarks.harness.options import harness_parser
from benchmarks.harness.sharing import shared_programs
from benchmarks.harness.subject import conclude, train_subject
from benchmarks.harness.telling import told
from benchmarks.harness.watching import Outcome, observe

from skillcrew.analysis import report

SECONDS = 120
"""That a command may take; the first of its kind compiles."""

COMMANDS = {
    "evaluate": ("--json", "--episodes", "20"),
    "report": ("--episodes", "20"),
    "resume": ("--report-episodes", "20"),
    "resume further": ("--report-episodes", "20", "--steps", "1100"),
}
DRAWN_EVERY = 50
"""Cases between two whose figures are drawn: drawing takes longer than all else."""

NOTES = re.compile(
    r"Goes on from generation|Nothing to do|Compiled in|Needs about|No checkpoint was finished|"
    r"[\d.]+ ?[kMG]? of [\d.]+ ?[kMG]? steps, |"
    r".*checkpoint \d+ is used instead$|.* is gone, and with it all rows"
)
"""What a command that trains says beside its results and its refusals."""


@dataclasses.dataclass(frozen=True)
class Damage:
    """What happens to one file."""

    file: str
    kind: str
    place: float
    """Where in the file it begins, as a share of its length."""
    bit: int

    def befall(self, folder: Path) -> None:
        path = folder / self.file
        whole = path.read_bytes()
        at = min(int(self.place * len(whole)), max(len(whole) - 1, 0))
        if self.kind == "deleted":
            path.unlink()
        elif self.kind == "emptied" or not whole:
            path.write_bytes(b"")
        elif self.kind == "cut off":
            path.write_bytes(whole[:at])
        elif self.kind == "zeroed":
            path.write_bytes(whole[:at] + bytes(len(whole) - at))
        else:
            path.write_bytes(whole[:at] + bytes([whole[at] ^ (1 << self.bit)]) + whole[at + 1 :])


KINDS = ("flipped", "cut off", "zeroed", "emptied", "deleted")


def draw_damage(folder: Path, dice: random.Random) -> Damage:
    """One damage; files of checkpoints, most of the files, are drawn half of the time."""
    files = [str(path.relative_to(folder)) for path in sorted(folder.rglob("*")) if path.is_file()]
    inner = [file for file in files if file.startswith("checkpoints/")]
    file = dice.choice(inner if dice.random() < 0.5 else sorted(set(files) - set(inner)))
    return Damage(file, dice.choice(KINDS), dice.random(), dice.randrange(8))


@dataclasses.dataclass(frozen=True)
class Ending:
    """What a command left, as far as it is a result."""

    out: str
    arrays: Mapping[str, np.ndarray]


class Damages:
    """The undamaged endings of one finished run, and what damage makes of them.

    Args:
        finished: its folder, which is only read.
        room: an empty folder to work in.
    """

    def __init__(self, finished: Path, room: Path):
        self.finished = finished
        self.room = room
        checkpoints = (finished / "checkpoints").iterdir()
        self.generations = sorted(int(path.name) for path in checkpoints if path.name.isdecimal())

    def problems(
        self, damage: Damage, commands: Collection[str] = tuple(COMMANDS), drawn: bool = False
    ) -> list[str]:
        """What the commands make of a damaged copy that they must not; `drawn` draws all figures."""
        found = []
        for command in commands:
            folder = self._copy()
            damage.befall(folder)
            outcome, before, after = self._run(command, folder, drawn)
            problem = self._problem(command, damage, outcome, before, after)
            if problem:
                found.append(f"{command}: {problem}")
        return found

    def _problem(
        self,
        command: str,
        damage: Damage,
        outcome: Outcome,
        before: Mapping[str, bytes],
        after: Mapping[str, bytes],
    ) -> str:
        if outcome.hung:
            return "hang"
        if outcome.raised:
            return "traceback: " + outcome.raised
        ours = [line for line in outcome.err.splitlines() if line.startswith("skillcrew: ")]
        noise = [line for line in outcome.err.splitlines() if line not in ours]
        if command.startswith("resume"):
            noise = [line for line in noise if not NOTES.match(line)]
        if noise or len(ours) > 1:
            return f"other words: {outcome.err}"
        if outcome.code == 2:
            return _refused_wrongly(damage, outcome, ours, before, after)
        if outcome.code != 0:
            return f"exit code {outcome.code}"
        return self._other_result(command, outcome)

    def _other_result(self, command: str, outcome: Outcome) -> str:
        generation, gone = self.generations[-1], "is gone, and with it all rows" in outcome.err
        if instead := re.search(r"checkpoint (\d+) is used instead", outcome.err):
            generation = int(instead[1])
            if generation != self.generations[-2]:
                return f"not the checkpoint before: {outcome.err}"
        expected = self._expected(command, generation)
        said, left = outcome.out, expected.out
        if "a report without a learning curve" in outcome.err:
            said, left = _without_curve(said), _without_curve(left)
        if said != left:
            return f"different: {outcome.out}"
        if not command.startswith("resume"):
            return ""
        found = ending(self.room / "run")
        names = {*found, *expected.arrays}
        counted = [name for name in sorted(names) if not (gone and name.startswith("metrics: "))]
        differing = [
            name
            for name in counted
            if not (name in found and name in expected.arrays and same(found[name], expected.arrays[name]))
        ]
        return f"different: {differing}" if differing else ""

    @functools.cache  # noqa: B019 (it lives as long as the program)
    def _expected(self, command: str, generation: int) -> Ending:
        """How a command ends without damage, from some checkpoint."""
        folder = self._copy()
        for later in self.generations:
            if later > generation:
                shutil.rmtree(folder / "checkpoints" / str(later))
        outcome, *_ = self._run(command, folder, drawn=False)
        if outcome.code != 0:
            raise SystemExit(f"{command} fails without damage: {outcome}")
        return Ending(outcome.out, ending(folder) if command.startswith("resume") else {})

    def _run(
        self, command: str, folder: Path, drawn: bool
    ) -> tuple[Outcome, Mapping[str, bytes], Mapping[str, bytes]]:
        words = [command.split()[0], str(folder), *COMMANDS[command]]
        before = contents(folder)
        with contextlib.nullcontext() if drawn else no_drawing():
            return observe(words, SECONDS), before, contents(folder)

    def _copy(self) -> Path:
        folder = self.room / "run"
        shutil.rmtree(folder, ignore_errors=True)
        return shutil.copytree(self.finished, folder)


@contextlib.contextmanager
def no_drawing() -> Generator[None]:
    """Leaves figures out of reports; what they would show is computed all the same."""

    def save(_: object, path: Path) -> list[Path]:
        path.parent.mkdir(exist_ok=True)
        return [path.with_suffix(".png"), path.with_suffix(".pdf")]

    with contextlib.ExitStack() as stack:
        for name in ("learning_curves", "skill_distribution"):
            stack.enter_context(mock.patch.object(report, name, lambda *_: None))
        yield stack.enter_context(mock.patch.object(report, "save", save))


def _refused_wrongly(
    damage: Damage, outcome: Outcome, ours: list[str], before: Mapping[str, bytes], after: Mapping[str, bytes]
) -> str:
    if outcome.out:
        return f"a refusal with results: {outcome.out}"
    if len(ours) != 1:
        return f"a refusal of {len(ours)} lines: {outcome.err}"
    named = Path(damage.file).name
    if named not in ours[0] and not (damage.file.startswith("checkpoints/") and "/checkpoints" in ours[0]):
        return f"the line does not name {named}: {ours[0]}"
    changed = sorted(name for name in {*before, *after} if before.get(name) != after.get(name))
    return f"changed after a refusal: {changed} ({ours[0]})" if changed else ""


def _without_curve(text: str) -> str:
    """What a command says, but for the files of the curve, and how many files there are."""
    lines = [line for line in text.splitlines() if "learning_curve" not in line]
    return re.sub(r"and \d+ more", "and more", "\n".join(lines))


def contents(folder: Path) -> dict[str, bytes]:
    """Every file below a folder, but for what links lead to."""
    files = (path for path in sorted(folder.rglob("*")) if path.is_file() and not path.is_symlink())
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


def run_damages(
    finished: Path, room: Path, count: int, seed: int, in_turn: tuple[str, ...] = ()
) -> tuple[str, list[str]]:
    """Damages a run so many times.

    Args:
        in_turn: of `COMMANDS`; each damage meets one of them. By default it meets all that there are.

    Returns:
        The line that sums it up, and what went wrong, a text each.
    """
    dice, tally, problems = random.Random(seed), collections.Counter(), []
    with shared_programs():
        damages = Damages(finished, room)
        for number in told(range(count), problems):
            damage = draw_damage(finished, dice)
            commands = in_turn[number % len(in_turn) :][:1] if in_turn else tuple(COMMANDS)
            wrong = damages.problems(damage, commands, drawn=number % DRAWN_EVERY == DRAWN_EVERY - 1)
            problems += [f"{number}: {damage}\n  {text}" for text in wrong]
            tally[_kind(wrong)] += 1
    summary = (
        f"{count} damages: {tally['fine']} found or harmless, {tally['different']} different, "
        f"{tally['tracebacks']} tracebacks"
    )
    return summary + (f", {tally['hangs']} hangs" if tally["hangs"] else "") + f" (seed {seed})", problems


def _kind(wrong: list[str]) -> str:
    if any(": traceback: " in text for text in wrong):
        return "tracebacks"
    if any(text.endswith(": hang") for text in wrong):
        return "hangs"
    return "different" if wrong else "fine"


def main() -> int:
    arguments = parse_arguments()
    with tempfile.TemporaryDirectory(prefix="damages-") as name:
        place = Path(name)
        finished, room = place / "finished", place / "room"
        room.mkdir()
        train_subject(finished)
        summary, problems = run_damages(finished, room, arguments.count, arguments.seed)
    return conclude(summary, problems)


def parse_arguments() -> argparse.Namespace:
    parser = harness_parser(__doc__)
    parser.add_argument("--count", type=int, default=500, help="how many damages (default: 500)")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
