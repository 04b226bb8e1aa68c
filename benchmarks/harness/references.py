"""Runs left in peace, with whose ending others are compared."""

import json
import os
from collections.abc import Callable, Sequence
from pathlib import Path

os.environ.setdefault("JAX_PLATFORMS", "cpu")

import jax
from benchmarks.harness.endings import digests, ending
from benchmarks.harness.forks import Ended, forked
from benchmarks.harness.small_runs import compare_words, train_words

from skillcrew.cli import compare, report, resume, train  # noqa: F401 (forks need not import them)
from skillcrew.cli.main import run_command


class References:
    """What commands end with if nothing befalls them, and how long they take.

    Args:
        place: an empty folder.
    """

    def __init__(self, place: Path):
        self._place = place
        self._known: dict[str, tuple[dict[str, str], float, float]] = {}

    def serving(self, algorithms: Sequence[str]) -> list[str]:
        """Those that run here; says which do not, and why."""
        served = []
        for name in algorithms:
            try:
                self.of("train", name)
                served.append(name)
            except RuntimeError as error:
                print(f"left out: {name}: {str(error).strip().splitlines()[-1]}", flush=True)
        return served

    def of(self, command: str, algorithm: str) -> tuple[dict[str, str], float, float]:
        """An undisturbed ending, and the seconds that it took without and with compiling.

        Raises:
            RuntimeError: the command fails.
        """
        name = self._name(command, algorithm)
        if name not in self._known:
            folders = [self._place / f"{name}-{number}" for number in range(2)]
            words = [self.words(command, algorithm, folder) for folder in folders]
            cold = self.run(words[0], fills=True)
            if cold.code != 0:
                raise RuntimeError(cold.said)
            warm, expected = self.run(words[1]), self.ending(folders[0])
            if self.ending(folders[1]) != expected:
                raise SystemExit(f"{name}: two undisturbed runs end differently")
            self._known[name] = expected, warm.seconds, cold.seconds
            print(f"{name}: {warm.seconds:.1f} s, {cold.seconds:.1f} s with compiling", flush=True)
        return self._known[name]

    def took(self, command: str, algorithm: str, cold: bool, seconds: float) -> None:
        """A command has ended by itself after so many seconds, sooner than its reference had."""
        name = self._name(command, algorithm)
        expected, warm_before, cold_before = self._known[name]
        warm_seconds, cold_seconds = (warm_before, seconds) if cold else (seconds, cold_before)
        self._known[name] = expected, warm_seconds, cold_seconds

    def words(self, command: str, algorithm: str, folder: Path) -> list[str]:
        """A command line that writes all into `folder`."""
        if command == "train":
            return train_words(algorithm, folder)
        if command == "compare":
            return compare_words(folder)
        finished = self._place / f"train-{algorithm}-0"
        return ["report", str(finished), "--episodes", "20", "--out", str(folder / "report.html")]

    def again(self, command: str, algorithm: str, folder: Path) -> list[str]:
        """The command line that takes it to its end after something befell it."""
        begun = command == "train" and (folder / "config.yaml").exists()
        return (
            ["resume", str(folder), "--report-episodes", "20"]
            if begun
            else self.words(command, algorithm, folder)
        )

    def run(
        self,
        words: Sequence[str],
        cold: bool = False,
        after: float = float("inf"),
        befall: Callable[[int], None] | None = None,
        fills: bool = False,
    ) -> Ended:
        """Gives a command line in a fork.

        Args:
            cold: whether it compiles all anew.
            after, befall: see `forked`.
            fills: whether what it compiles is kept for others.
        """

        def work() -> int:
            # Who is killed while it writes a compiled program leaves half of it to others.
            place, least = None if cold else str(self._place / "compiled"), 0 if fills else 1e9
            jax.config.update("jax_compilation_cache_dir", place)
            jax.config.update("jax_persistent_cache_min_compile_time_secs", least)
            # From here the processes that it starts have it.
            os.environ["JAX_COMPILATION_CACHE_DIR"] = place or ""
            os.environ["JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS"] = str(least)
            return run_command(list(words))

        return forked(work, after, befall)

    def _name(self, command: str, algorithm: str) -> str:
        return command if command == "compare" else f"{command}-{algorithm}"

    def ending(self, folder: Path) -> dict[str, str]:
        """Digests of all below a folder that must be the same."""
        written = self._place / "ending.json"
        ended = forked(lambda: written.write_text(json.dumps(_ending_of(folder))) and 0)
        if ended.code != 0:
            raise SystemExit(ended.said)
        return json.loads(written.read_text())

    def problem(self, command: str, algorithm: str, folder: Path) -> str:
        """Takes what something befell to its end; how that differs from an undisturbed one, or nothing."""
        last = self.run(self.again(command, algorithm, folder))
        if last.code != 0:
            return f"exit code {last.code}: {last.said.strip()[-2000:]}"
        found, (expected, *_) = self.ending(folder), self.of(command, algorithm)
        differing = sorted(name for name in {*found, *expected} if found.get(name) != expected.get(name))
        return f"different: {differing}" if differing else ""


def _ending_of(folder: Path) -> dict[str, str]:
    found = {}
    for config in sorted(folder.rglob("config.yaml")):
        run = config.parent
        found |= {f"{run.relative_to(folder)} {name}": of for name, of in digests(ending(run)).items()}
    for name in ("scores.json", "table.csv"):
        for path in sorted(folder.rglob(name)):
            found[str(path.relative_to(folder))] = path.read_text()
    return found


def activity(folder: Path) -> str:
    """What a killed command was doing, as its folder tells."""
    if not folder.exists():
        return "start"
    if any(folder.rglob("checkpoints/*tmp*")):
        return "writing a checkpoint"
    if any(folder.rglob(".*")):
        return "writing a file"
    if not any(folder.rglob("timing.json")):
        return "compilation"
    return "the report" if any(folder.rglob("report")) else "generations"
