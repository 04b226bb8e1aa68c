"""Command lines that are nearly right."""

import functools
import random

from benchmarks.harness.values import TEXTS, mutated

from skillcrew.algorithms.registry import ALGORITHMS, algorithm_class
from skillcrew.cli import check, compare, evaluate, render, report, reproduce, resume, train
from skillcrew.cli.environments import with_environment
from skillcrew.cli.main import COMMANDS
from skillcrew.cli.options import option_names
from skillcrew.cli.vocabulary import SHELLS
from skillcrew.envs.registry import find
from skillcrew.experiment.figures import FIGURES, SETS, environments

ENDING = tuple(command for command in COMMANDS if command != "studio")
"""Commands that end by themselves."""

ENVIRONMENTS = ("rover-t2-c1", "rover-t3-c3-drawn", "rover-t2-crew", "rescue-v1-c2", "warehouse-o1-c2")

OPTIONS = {
    "resume": resume.ResumeOptions,
    "evaluate": evaluate.EvaluateOptions,
    "render": render.RenderOptions,
    "report": report.ReportOptions,
    "reproduce": reproduce.ReproduceOptions,
}


def draw_words(dice: random.Random) -> list[str]:
    """A command, its places and a few options; most of it right, some of it not."""
    command = dice.choice(ENDING)
    words = [command, *_places(command, dice)]
    names = _names(command, *words[1:3]) if all(map(str.isprintable, words)) else ("--json",)
    for _ in range(dice.choice((0, 1, 1, 1, 2, 3))):
        name = dice.choice(names)
        words += _option(mutated(name, dice) if dice.random() < 0.05 else name, dice)
    if dice.random() < 0.1:
        words[dice.randrange(len(words))] = dice.choice(TEXTS)
    if dice.random() < 0.05:
        dice.shuffle(words)
    return [word for word in words if "\0" not in word]


def _places(command: str, dice: random.Random) -> list[str]:
    algorithm, environment = dice.choice(list(ALGORITHMS)), dice.choice(ENVIRONMENTS)
    right = {
        "train": dice.choice(([algorithm, environment], ["--config", "config.yaml"])),
        "check": [environment],
        "compare": [f"{algorithm},{dice.choice(list(ALGORITHMS))}", environment],
        "reproduce": [dice.choice([*FIGURES, *SETS, *environments()])],
        "list": [],
        "completion": [dice.choice(SHELLS)],
    }.get(command, ["run"])
    return [
        dice.choice(TEXTS) if dice.random() < 0.15 else mutated(word, dice) if dice.random() < 0.05 else word
        for word in right
    ]


def _option(name: str, dice: random.Random) -> list[str]:
    value = dice.choice(TEXTS) if dice.random() < 0.8 else dice.choice(("5", "0.5", "run2", "closest"))
    match dice.randrange(6):
        case 0:
            return [f"{name}={value}"]
        case 1:
            return [name]
        case 2:
            return [name, value, dice.choice(TEXTS)]
        case _:
            return [name, value]


@functools.cache
def _names(command: str, *places: str) -> tuple[str, ...]:
    """The options that a command line may have."""
    try:
        if command == "train":
            if places[0] == "--config":
                return tuple(option_names(train.RunOptions))
            kind, entry = algorithm_class(places[0]), find(places[1])
            options, _ = with_environment(train.RunOptions, entry, {"algorithm": kind.config_class()})
        elif command == "compare":
            options, _ = with_environment(compare.CompareOptions, find(places[1]))
        elif command == "check":
            options, _ = with_environment(check.CheckOptions, find(places[0]))
        else:
            options = OPTIONS[command]
    except Exception:
        return ("--json", "--steps", "--seeds", "--out")
    return (*option_names(options), "--help")
