"""The run that harnesses work on, and how they end."""

from collections.abc import Sequence
from pathlib import Path

from benchmarks.harness.watching import observe

TRAIN = (
    *("train", "madys", "rover-t2-c2", "--seeds", "2", "--steps", "900", "--score-episodes", "3"),
    *("--generations-per-report", "2", "--checkpoint-seconds", "0", "--report-episodes", "20"),
    *("--environment.episode-length", "6", "--environment.activation-distance", "9"),
    *("--algorithm.skills", "go_to_poi_A", "go_to_poi_B"),
    *("--algorithm.population", "7", "--algorithm.episodes", "2", "--algorithm.probe-episodes", "1"),
    *("--algorithm.updates", "2", "--algorithm.buffer-capacity", "400", "--algorithm.selector.hidden", "8"),
    *("--algorithm.learner.batch-size", "8", "--algorithm.learner.network.hidden", "8"),
)


def train_subject(folder: Path) -> None:
    """Trains it to its end; leaves the program if that fails."""
    trained = observe([*TRAIN, "--out", str(folder)], 600)
    if trained.code != 0:
        raise SystemExit(f"the run itself failed: {trained}")


def conclude(summary: str, problems: Sequence[str]) -> int:
    """Prints what was found, and how much of it; returns the exit code."""
    for problem in problems:
        print(problem)
    print(summary)
    return 1 if problems else 0
