"""`skillcrew train ALGORITHM ENVIRONMENT`."""

import dataclasses
from pathlib import Path
from typing import Any, Literal

from skillcrew.algorithms.registry import ALGORITHMS, algorithm_class
from skillcrew.cli.arguments import NO_TRACKERS, Seeds, TrackerNames
from skillcrew.cli.conclusion import run_and_report
from skillcrew.cli.environments import configured, environment_names, with_environment
from skillcrew.cli.options import parse_options
from skillcrew.cli.present import take_places
from skillcrew.envs.registry import Entry, find
from skillcrew.errors import UserError
from skillcrew.experiment.config import RunConfig, from_yaml
from skillcrew.experiment.origin import Origin
from skillcrew.experiment.progress import make_reporter
from skillcrew.experiment.run import free_folder, train
from skillcrew.experiment.trackers.tracking import Tracking

DEFAULTS = RunConfig()
DEFAULT_SEEDS = Seeds(DEFAULTS.seeds)


@dataclasses.dataclass(frozen=True)
class RunOptions:
    """Options of the run."""

    seeds: Seeds = DEFAULT_SEEDS
    """How many runs (5: seeds 0 to 4), or which (2000..2004, or 1,5,9); all in one program."""
    steps: int = DEFAULTS.steps
    """Environment steps per seed, such as 4e6."""
    out: Path | None = None
    """The run's folder. Default: runs/ALGORITHM-ENVIRONMENT, numbered if it exists."""
    score_episodes: int = DEFAULTS.score_episodes
    """Fresh episodes on which each generation's champion is scored; they do not count as steps."""
    report_episodes: int = 1000
    """Fresh episodes of the final score and of the report."""
    generations_per_report: int = DEFAULTS.generations_per_report
    """Generations between two lines of progress."""
    checkpoint_seconds: float = DEFAULTS.checkpoint_seconds
    """Time between checkpoints."""
    keep: int = DEFAULTS.keep
    """Latest checkpoints kept, beside the best."""
    max_seconds: float | None = None
    """Seconds after which it saves and stops as on Ctrl-C, compiling not counted; for queues that kill."""
    warning_signal: str | None = None
    """A further signal on which it saves and stops, such as the USR1 that Slurm sends before it kills."""
    on_bad_numbers: Literal["stop", "roll-back"] = DEFAULTS.on_bad_numbers
    """What happens where a number is not finite: "stop", which says where it came from, or "roll-back" to the
    last checkpoint to go on from there by other random numbers, a few times."""
    save_buffer: bool = DEFAULTS.save_buffer
    """Keep the replay buffer in checkpoints; without, they are small but a resumed run differs."""

    trackers: TrackerNames = NO_TRACKERS
    """Who keeps a record beside the run's own files: tensorboard, wandb or both (extra `tracking`)."""
    skills_from: Origin | None = None
    """Folder of a run whose skills of the same names are taken over; the others begin at random."""
    skills_frozen: bool = False
    """Skills that are taken over learn no more."""
    team_from: Origin | None = None
    """Folder of a run whose champions the search begins around, of the same skills and structure."""
    trust: bool = False
    """Import classes of environments from wherever --config, --skills-from and --team-from say: that runs
    their code."""

    quiet: bool = False
    """No progress: the final score and errors alone."""

    def run_config(self) -> dict[str, Any]:
        """The fields of `RunConfig` among these, but for seeds and steps."""
        shared = {field.name for field in dataclasses.fields(RunConfig)} - {"seeds", "steps"}
        return {name: getattr(self, name) for name in shared}


def run(words: list[str]) -> int:
    """Trains, then writes and announces the report; 130 if interrupted after saving."""
    if words[:1] == ["--config"]:
        return _train_from_file(words[1:])
    names = take_places(words, ("ALGORITHM", "ENVIRONMENT"), usage())
    if names is None:
        print(usage())
        return 0
    algorithm_name, environment_name = names
    kind = algorithm_class(algorithm_name)
    entry = find(environment_name)
    options = _options(kind, entry, words)
    algorithm = kind(configured(entry, options).make(), options.algorithm)
    return train_and_report(algorithm, options)


def _options(kind: Any, entry: Entry, words: list[str]) -> Any:
    fields = {"algorithm": kind.config_class()}
    options_class, default = with_environment(RunOptions, entry, fields)
    return parse_options(options_class, words[2:], default, ("train", words[0], words[1]), usage())


def _train_from_file(words: list[str]) -> int:
    if not words:
        raise UserError("train --config: name a configuration file, such as a run folder's config.yaml")
    algorithm, config = from_yaml(Path(words[0]), trust="--trust" in words)
    fields: dict[str, Any] = {name: getattr(config, name) for name in RunOptions().run_config()}
    fields["trackers"] = TrackerNames(config.trackers)
    default = RunOptions(Seeds(config.seeds), config.steps, **fields)
    options = parse_options(RunOptions, words[1:], default, ("train", "--config", "FILE"), usage())
    return train_and_report(algorithm, options)


def train_and_report(algorithm: Any, options: RunOptions) -> int:
    """Trains in a new folder and reports; see `run_and_report`."""
    out = options.out or free_folder(algorithm)
    reporter = make_reporter(options.steps, tuple(options.seeds), quiet=options.quiet)
    reporter.note(
        f"{algorithm.name} on {algorithm.env.name}: {len(options.seeds)} seed(s), {options.steps:,} "
        f"environment steps each, into {out}"
    )
    return run_and_report(
        lambda tracking: train(
            algorithm,
            options.seeds,
            options.steps,
            out,
            reporter,
            tracking,
            trust=options.trust,
            **options.run_config(),
        ),
        reporter,
        lambda: Tracking(options.trackers, reporter.note),
        str(out),
        options.report_episodes,
    )


def usage() -> str:
    """What `skillcrew train --help` prints before the options of an algorithm and environment."""
    return (
        "usage: skillcrew train ALGORITHM ENVIRONMENT [OPTIONS]\n"
        "       skillcrew train --config FILE [OPTIONS]\n\n"
        f"ALGORITHM    one of {', '.join(ALGORITHMS)}\n"
        f"ENVIRONMENT  one of {environment_names()};\n"
        "             or the import path of your own, such as mylab.rescue:Rescue or rescue.py:Rescue\n\n"
        "Every option has a measured default; `skillcrew train madys rover-t2-c1 --help` explains them all.\n"
        "Trains one run per seed and ends with a report; Ctrl-C saves and says how to go on."
    )
