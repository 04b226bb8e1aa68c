"""Gives the commands what no one should: odd words, odd configurations, odd metrics, odd run folders.

    python -m benchmarks.harness.inputs                        # 100,000 inputs
    python -m benchmarks.harness.inputs --count 300 --seed 7
    python -m benchmarks.harness.inputs --only 4711            # one of them again, and what it is

Training, and drawing, are left out; all that comes before runs in this process. Each input must end with exit
code 0, 2 (then with one line on standard error that says so) or 130, within ten seconds, and without a trace
outside its folder: no file written, no program started, no code imported that a file names.

Anything else is printed, with the input; the last line counts. Exits with 1 if there is any.
"""

import argparse
import collections
import contextlib
import dataclasses
import os
import random
import shutil
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import yaml

os.environ.setdefault("JAX_PLATFORMS", "cpu")

from benchmarks.harness.command_lines import draw_words
from benchmarks.harness.damages import contents
from benchmarks.harness.hostile_files import draw_config, draw_metrics
from benchmarks.harness.hostile_folders import draw_folder
from benchmarks.harness.options import harness_parser
from benchmarks.harness.sandbox import CANARY, Watch
from benchmarks.harness.shortcuts import no_checkpoints, no_training
from benchmarks.harness.subject import conclude, train_subject
from benchmarks.harness.telling import told
from benchmarks.harness.watching import Outcome, observe

SECONDS = 10
LONGEST_LINE = 2000
ALLOWED = (0, 2, 130)
SHARES = {"words": 0.5, "config": 0.4, "metrics": 0.04, "folder": 0.06}


@dataclasses.dataclass(frozen=True)
class Input:
    """One command line, and what its files were made to be."""

    kind: str
    words: tuple[str, ...]
    about: str = ""


class Inputs:
    """Makes inputs in a folder, and gives them to the commands.

    Args:
        finished: a finished run, which is only read.
        place: an empty folder; all is done below it.
    """

    def __init__(self, finished: Path, place: Path, seed: int):
        self._finished, self._place, self._seed = finished, place, seed
        self._work, self._victim = place / "work", place / "victim"
        self._config = _few_fields(yaml.safe_load((finished / "config.yaml").read_text()))
        self._metrics = (finished / "metrics.parquet").read_bytes()
        self._watch = Watch(place)
        self._clean = False

    def problem(self, number: int) -> tuple[Input, str]:
        """Makes and gives one input; what is wrong with how it ended, or nothing."""
        dice = random.Random(f"{self._seed} {number}")
        self._tidy()
        given = self._make(dice)
        victim = contents(self._victim)
        os.chdir(self._work)
        # Reading checkpoints takes longer than all else; they are what they were but in hostile folders.
        spared = given.kind in ("words", "config")
        with no_checkpoints() if spared else contextlib.nullcontext(), self._watch.on():
            outcome = observe(given.words, SECONDS)
        os.chdir(self._place)
        noted = list(self._watch.noted)
        if contents(self._victim) != victim:
            noted.append("changed what a link leads to")
        return given, _wrong(given, outcome, noted)

    def _make(self, dice: random.Random) -> Input:
        kind = dice.choices(list(SHARES), list(SHARES.values()))[0]
        if kind == "words":
            return Input(kind, tuple(draw_words(dice)))
        self._clean = False
        run = self._work / "run"
        if kind == "config":
            written = draw_config(self._config, dice)
            (run / "digests.json").unlink()
            for path in (run / "config.yaml", self._work / "given.yaml"):
                path.write_bytes(written)
            words = dice.choice(
                (
                    ("train", "--config", "given.yaml", "--out", "new"),
                    ("compare", "given.yaml,ea", "rover-t2-c2", "--out", "new"),
                    ("evaluate", "run", "--episodes", "5"),
                    ("resume", "run"),
                )
            )
            return Input(kind, words, repr(written[:3000]))
        command = dice.choice((("evaluate", "run", "--json"), ("report", "run"), ("resume", "run")))
        if kind == "metrics":
            written = draw_metrics(self._metrics, dice)
            (run / "digests.json").unlink()
            (run / "metrics.parquet").write_bytes(written)
            return Input(kind, dice.choice((("report", "run"), ("resume", "run"))), repr(written[:300]))
        if dice.random() < 0.2:
            command = ("train", "--config", "run/config.yaml", "--out", "new")
        return Input(kind, command, draw_folder(run, self._victim, dice))

    def _tidy(self) -> None:
        """Lays everything out as at first; after words alone, only what they have made is taken away."""
        if self._clean and not _news(self._work):
            return
        for folder in (self._work, self._victim):
            shutil.rmtree(folder, ignore_errors=True)
        (self._victim / "folder" / "3").mkdir(parents=True)
        for name in ("letter.txt", "folder/letter.txt", "folder/3/letter.txt"):
            (self._victim / name).write_text("Dear reader")
        self._work.mkdir()
        shutil.copytree(self._finished, self._work / "run")
        shutil.copy(self._finished / "config.yaml", self._work)
        (self._work / "bad.yaml").write_text("algorithm: [")
        for name in ("folder", "empty", "folder.py"):
            (self._work / name).mkdir()
        for name in ("file.txt", "folder/file.txt"):
            (self._work / name).write_text("text")
        (self._work / "broken.py").write_text("def")
        (self._work / f"{CANARY}.py").write_text("class World: ...\ndef near(*_): return 0\n")
        os.mkfifo(self._work / "fifo")
        (self._work / "loop").symlink_to("loop")
        self._clean = True


LAID_OUT = {
    *(
        "run",
        "config.yaml",
        "bad.yaml",
        "folder",
        "empty",
        "folder.py",
        "file.txt",
        "broken.py",
        "fifo",
        "loop",
    ),
    f"{CANARY}.py",
}


def _few_fields(config: dict[str, Any]) -> dict[str, Any]:
    """Some of a configuration; the rest has its defaults, and reading it would take most of the time."""
    kept = {
        "algorithm": ("name", "skills", "population", "updates", "buffer_capacity", "selector", "plateau"),
        "environment": ("name", "n_agents", "episode_length", "parents", "poi_values", "sensor"),
        "run": ("seeds", "steps", "score_episodes", "checkpoint_seconds", "save_buffer", "warning_signal"),
    }
    return {
        section: {name: config[section][name] for name in names if name in config[section]}
        for section, names in kept.items()
    }


def _news(work: Path) -> bool:
    return {path.name for path in work.iterdir()} != LAID_OUT or (
        work / "run" / "owner.lock"
    ).stat().st_size > 0


def _wrong(given: Input, outcome: Outcome, noted: list[str]) -> str:
    if outcome.hung:
        return "hang"
    if outcome.raised:
        return "traceback: " + outcome.raised
    if outcome.code not in ALLOWED:
        return f"exit code {outcome.code}: {outcome.err}"
    if noted:
        return f"escape: {noted}"
    if "Traceback (most recent" in outcome.err:
        return "traceback: " + outcome.err
    ours = [line for line in outcome.err.split("\n") if line.startswith("skillcrew: ")]
    if outcome.code == 2 and given.words:
        # What training says before it begins is no part of the complaint.
        # Nor is what is said of a checkpoint that stands in for another.
        said = [line for line in outcome.err.splitlines() if not line.endswith("is used instead")]
        last = outcome.err.removesuffix("\n").rpartition("\n")[2]
        alone = given.words[0] in ("train", "resume") or len(said) == 1
        if not (alone and last.startswith("skillcrew: ") and last.isprintable()):
            return f"words: {outcome.err!r}"
        if len(last) >= LONGEST_LINE:
            return f"words: a line of {len(last)} letters: {last[:300]}"
    if any("\r" in line for line in ours):
        return f"words: {outcome.err!r}"
    return ""


def run_inputs(
    finished: Path, place: Path, numbers: range, seed: int, seconds: float = float("inf")
) -> tuple[str, list[str]]:
    """Gives so many inputs, or as many as time allows.

    Returns:
        The line that sums it up, and what went wrong, a text each.
    """
    tally, problems, began, here = collections.Counter(), [], time.monotonic(), Path.cwd()
    try:
        with no_training():
            inputs = Inputs(finished, place, seed)
            for number in told(numbers, problems):
                if time.monotonic() - began > seconds:
                    break
                given, wrong = inputs.problem(number)
                tally["all"] += 1
                tally[wrong.partition(":")[0].partition(" ")[0]] += 1
                if wrong:
                    problems.append(f"{number}: {given.kind} {list(given.words)} {given.about}\n  {wrong}")
    finally:
        os.chdir(here)
    summary = (
        f"{tally['all']:,} inputs: {tally['traceback']} tracebacks, {tally['hang']} hangs, "
        f"{tally['exit']} other exit codes"
    )
    others = "".join(f", {tally[kind]} {kind}" for kind in ("escape", "words") if tally[kind])
    return f"{summary}{others} (seed {seed})", problems


def main() -> int:
    arguments = parse_arguments()
    numbers = range(arguments.count) if arguments.only is None else range(arguments.only, arguments.only + 1)
    with tempfile.TemporaryDirectory(prefix="inputs-") as name:
        place = Path(name)
        finished = Path(arguments.finished) if arguments.finished else place / "finished"
        if not finished.exists():
            train_subject(finished)
        (place / "room").mkdir()
        summary, problems = run_inputs(
            finished.absolute(), place / "room", numbers, arguments.seed, arguments.seconds
        )
    return conclude(summary, problems)


def parse_arguments() -> argparse.Namespace:
    parser = harness_parser(__doc__)
    parser.add_argument("--count", type=int, default=100_000, help="how many inputs (default: 100000)")
    parser.add_argument("--only", type=int, help="the number of the one to give")
    parser.add_argument("--finished", help="a finished run to begin from; made there if it is missing")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="stop after so long")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
