"""A run of any algorithm that is so small that compiling and checkpoints take most of its time."""

from pathlib import Path

from skillcrew.algorithms.registry import algorithm_class
from skillcrew.cli.options import option_names

ENVIRONMENT = "rover-t2-c2"
OF_RUN = {
    "steps": 2000,
    "seeds": 2,
    "score-episodes": 5,
    "report-episodes": 20,
    "generations-per-report": 2,
    "checkpoint-seconds": 0,
}
OF_ENVIRONMENT = {"episode-length": 10, "activation-distance": 8}
OF_ALGORITHM = {
    "population": 8,
    "episodes": 2,
    "probe-episodes": 1,
    "updates": 4,
    "buffer-capacity": 3000,
    "learner.batch-size": 32,
    "learner.network.hidden": 8,
    "selector.hidden": 8,
    "actor.hidden": 8,
    "policy.hidden": 8,
    "critic.hidden": 8,
    "evolution.elites": 2,
    "evolution.veterans": 1,
    "evolution.challengers": 2,
    "ppo.minibatches": 2,
    "liir.minibatches": 2,
    "coma.minibatches": 2,
}
"""Of which an algorithm takes those that it has."""
PHASES = ("madys-plus", "open-loop")
"""Whose timetables have more phases than such an episode has steps."""


def train_words(algorithm: str, folder: Path) -> list[str]:
    """The command line that trains it."""
    known = set(option_names(algorithm_class(algorithm).config_class))
    sizes = {f"algorithm.{name}": size for name, size in OF_ALGORITHM.items() if f"--{name}" in known}
    sizes |= {f"environment.{name}": size for name, size in OF_ENVIRONMENT.items()}
    sizes |= {"algorithm.selector.phases": 4} if algorithm in PHASES else {}
    options = [f"--{name}={value}" for name, value in {**OF_RUN, **sizes}.items()]
    return ["train", algorithm, ENVIRONMENT, "--out", str(folder), *options]


def compare_words(folder: Path) -> list[str]:
    """The command line that compares two of them, at a size of its own."""
    return ["compare", "ea,ccea", ENVIRONMENT, "--out", str(folder), "--seeds=2", "--steps=60000"]
