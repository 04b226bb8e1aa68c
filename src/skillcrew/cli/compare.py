"""`skillcrew compare METHODS ENVIRONMENT`."""

import dataclasses
from pathlib import Path

from skillcrew.algorithms.algorithm import Algorithm
from skillcrew.algorithms.registry import ALGORITHMS, make_algorithm
from skillcrew.cli.arguments import NO_TRACKERS, Seeds, TrackerNames
from skillcrew.cli.environments import configured, environment_names, with_environment
from skillcrew.cli.options import parse_options
from skillcrew.cli.present import take_places
from skillcrew.cli.side_by_side import run_side_by_side
from skillcrew.envs.environment import Environment
from skillcrew.envs.registry import find
from skillcrew.errors import UserError
from skillcrew.experiment.comparison import ComparedFigure, Comparison, PlannedRun
from skillcrew.experiment.config import RunConfig, algorithm_from_yaml
from skillcrew.experiment.trackers.tracker import tracker_class


def usage() -> str:
    """What `skillcrew compare --help` prints before its options."""
    return (
        "usage: skillcrew compare METHODS ENVIRONMENT [OPTIONS]\n\n"
        f"METHODS      two or more, with commas between: {', '.join(ALGORITHMS)}; or configuration files,\n"
        "             called by their names, where every field that is missing has its default:\n"
        "             madys,ccea,lenient.yaml\n"
        f"ENVIRONMENT  one of {environment_names()};\n"
        "             or the import path of your own, such as mylab.rescue:Rescue\n\n"
        "Trains all of them with the same seeds and environment steps, and ends in one figure, a table, and\n"
        "every run's configuration. The first method is the one that the others are compared with. Can be\n"
        "interrupted at any time: the same command goes on where it was."
    )


DEFAULT_SEEDS = Seeds(tuple(range(5)))


@dataclasses.dataclass(frozen=True)
class CompareOptions:
    """Options of `skillcrew compare`."""

    seeds: Seeds = DEFAULT_SEEDS
    """How many runs (5: seeds 0 to 4), or which (2000..2004, or 1,5,9); all in one program."""
    steps: int = 3_000_000
    """Environment steps per seed, such as 3e6; the same for all methods, pre-training included."""
    out: Path | None = None
    """Folder for runs and results; one that was begun is gone on with. Default: runs/compare-ENVIRONMENT."""
    trackers: TrackerNames = NO_TRACKERS
    """Who keeps a record of each run beside its own files: tensorboard, wandb or both (extra `tracking`)."""
    jobs: int | None = None
    """Runs side by side, each on its share of the cores. Default: one per core, or one on a GPU."""
    so_far: bool = False
    """Trains nothing: figures and tables of the runs that are finished."""


def run(words: list[str]) -> int:
    """Trains what is missing, then writes figure and table; 130 if interrupted after saving."""
    places = take_places(words, ("METHODS", "ENVIRONMENT"), usage())
    if places is None:
        print(usage())
        return 0
    methods, environment = places
    entry = find(environment)
    options_class, default = with_environment(CompareOptions, entry)
    called = ("compare", methods, environment)
    options = parse_options(options_class, words[2:], default, called, usage())
    chosen = configured(entry, options)
    env = chosen.make()
    names = tuple(options.trackers)
    for name in names:
        tracker_class(name)
    config = RunConfig(seeds=tuple(options.seeds), steps=options.steps, trackers=names)
    runs = _runs(_names(methods), env, config)
    title = f"{env.name}: mean of {len(options.seeds)} seeds, 95 % intervals"
    comparison = Comparison(
        f"This folder compares {', '.join(one.label for one in runs)} on {env.name}, with skillcrew.",
        runs,
        [ComparedFigure(env.name, title, (env.name,))],
    )
    out = options.out or Path("runs") / f"compare-{env.name}"
    again = ["compare", *words]
    return run_side_by_side(
        comparison, out, options.jobs, again, so_far=options.so_far, trust=chosen.is_foreign
    )


def _names(methods: str) -> list[str]:
    names = [name.strip() for name in methods.split(",")]
    if len(names) < 2 or not all(names):
        raise UserError(f"METHODS = {methods}: give two or more with commas between, such as madys,ea")
    return names


def _runs(methods: list[str], env: Environment, config: RunConfig) -> list[PlannedRun]:
    runs: list[PlannedRun] = []
    for method in methods:
        name, label, algorithm = _method(method, env)
        if name in [one.method for one in runs]:
            raise UserError(
                f"METHODS: {name} is given twice; files are called by their names without folders"
            )
        runs.append(PlannedRun(env.name, name, label, algorithm, config))
    return runs


def _method(method: str, env: Environment) -> tuple[str, str, Algorithm]:
    """What files and what figures call it, and the algorithm itself."""
    if method.endswith((".yaml", ".yml")):
        path = Path(method)
        if path.stem in ALGORITHMS:
            raise UserError(
                f"{path}: called like the algorithm {path.stem}; rename it to what is special of it"
            )
        return path.stem, path.stem, algorithm_from_yaml(path, env)
    algorithm = make_algorithm(method, env)
    return method, algorithm.label, algorithm
