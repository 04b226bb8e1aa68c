"""The whole configuration of a run, as a file that can be fed back."""

import dataclasses
from pathlib import Path
from typing import Any, Literal

import pydantic
import yaml

from skillcrew.algorithms.algorithm import Algorithm, filled_in
from skillcrew.algorithms.registry import algorithm_class, make_algorithm
from skillcrew.envs import registry
from skillcrew.envs.environment import Environment
from skillcrew.errors import UserError, unknown_name
from skillcrew.experiment.interrupts import signal_of
from skillcrew.experiment.origin import Origin, sayings
from skillcrew.experiment.trackers.names import check_names
from skillcrew.experiment.yaml_files import read_yaml

MOST_STEPS = 2_000_000_000
"""Steps are counted in 32 bits, and a count that is full (`MOST_COUNTED`) is to be beyond any budget."""

MOST_AT_ONCE = 1_000_000
"""Episodes that are played side by side, and rows between two reports: all are held in memory."""


OF_SESSION = ("max_seconds", "warning_signal", "on_bad_numbers", "trackers")
"""Fields of a run that may differ from session to session: while all numbers are finite, none changes any."""


@dataclasses.dataclass(frozen=True)
class RunConfig:
    """What a run needs to know beside its algorithm and its environment."""

    seeds: tuple[int, ...] = (0,)
    """One independent run per seed, all in one program."""
    steps: int = 2_000_000
    """Environment steps per seed; a seed's result is its champion at the last generation within them."""
    score_episodes: int = 100
    """Fresh episodes on which each generation's champion is scored. They do not count as steps."""
    generations_per_report: int = 5
    """Generations between two lines of progress; a run can be stopped and saved between them."""
    checkpoint_seconds: float = 60.0
    """Time between checkpoints. What is computed after the last one is computed again on resume."""
    keep: int = 2
    """Checkpoints that are kept, the latest ones; the best is kept beside them."""
    save_buffer: bool = True
    """False leaves the replay buffer out of checkpoints: small ones, but a resumed run differs."""

    max_seconds: float | None = None
    """Seconds after which a run saves and stops as on Ctrl-C, compiling not counted; for queues that kill."""
    warning_signal: str | None = None
    """A further signal on which it saves and stops, such as the USR1 that Slurm sends before it kills."""

    on_bad_numbers: Literal["stop", "roll-back"] = "stop"
    """What happens where a number is not finite: "stop", which says where it came from, or "roll-back" to the
    last checkpoint to go on from there by other random numbers, a few times."""

    trackers: tuple[str, ...] = ()
    """Who keeps a record beside the run's own files: "tensorboard", "wandb", or both."""
    skills_from: Origin | None = None
    """A run whose skills are taken over, those of the same names; the others begin at random. Its folder."""
    skills_frozen: bool = False
    """Whether skills that are taken over learn no more."""
    team_from: Origin | None = None
    """A run whose champions the search begins around, of the same skills and structure. Its folder."""

    def __post_init__(self) -> None:
        if self.skills_frozen and self.skills_from is None:
            raise UserError("skills_frozen = True: no skills are taken over; name a run as skills_from")
        if self.on_bad_numbers not in ("stop", "roll-back"):
            raise unknown_name("on_bad_numbers", self.on_bad_numbers, ("stop", "roll-back"))
        if self.max_seconds is not None and not self.max_seconds > 0:
            raise UserError(f"max_seconds = {self.max_seconds}: give a positive number")
        if self.warning_signal is not None:
            signal_of(self.warning_signal)
        check_names(self.trackers)
        if not self.seeds or len(set(self.seeds)) != len(self.seeds):
            raise UserError(f"seeds = {list(self.seeds)}: give at least one, and each once")
        if min(self.seeds) < 0 or max(self.seeds) >= 2**32:
            raise UserError(f"seeds = {list(self.seeds)}: give numbers from 0 to 2**32 - 1")
        if self.steps > MOST_STEPS:
            raise UserError(f"steps = {self.steps}: give at most {MOST_STEPS}")
        for field in ("steps", "score_episodes", "generations_per_report", "keep"):
            if getattr(self, field) < 1:
                raise UserError(f"{field} = {getattr(self, field)}: give at least 1")
        for field in ("score_episodes", "generations_per_report"):
            if getattr(self, field) > MOST_AT_ONCE:
                raise UserError(f"{field} = {getattr(self, field)}: give at most {MOST_AT_ONCE}")
        if not self.checkpoint_seconds >= 0:
            raise UserError(f"checkpoint_seconds = {self.checkpoint_seconds}: give a number of at least 0")

    def origins(self) -> list[str]:
        """What the run began with and what that had cost, a line for each; empty if with nothing."""
        return sayings(self.skills_from, self.team_from, self.skills_frozen)


def to_yaml(algorithm: Algorithm, run: RunConfig) -> str:
    """The resolved configuration: every field that is looked at, also those left at their defaults."""
    env = algorithm.env
    place = registry.place_of(env)
    described = env.describe()
    sections = {
        "algorithm": {"name": algorithm.name, **_looked_at(algorithm.config, env)},
        "environment": described if place is None else {"name": env.name, "class": place, **described},
        "run": dataclasses.asdict(run),
    }
    return yaml.safe_dump(_plain(sections), sort_keys=False, allow_unicode=True)


def _looked_at(config: Any, env: Environment) -> dict[str, Any]:
    """All fields but the sections that are neither looked at nor set, such as those of other evolvers."""
    fields, default = dataclasses.asdict(config), filled_in(env, type(config)())
    unused = config.unused(env) if hasattr(config, "unused") else set()
    kept = {name for name in fields if name not in unused or getattr(config, name) != getattr(default, name)}
    return {name: value for name, value in fields.items() if name in kept}


def from_yaml(path: Path, env: Environment | None = None, trust: bool = False) -> tuple[Algorithm, RunConfig]:
    """Reads a configuration file.

    Args:
        env: the environment, if it is at hand.
        trust: whether to import the environment's class from wherever the file says. That runs its code:
            without, only classes that skillcrew or an installed package's entry point offers are imported.

    Raises:
        UserError: unreadable, a section, field or value that is not valid, or code that is not trusted; the
            line names it.
    """
    sections = _sections(path)
    if set(sections) != {"algorithm", "environment", "run"}:
        raise UserError(f"{path}: needs the sections algorithm, environment and run, and no others")
    run = parse(RunConfig, sections["run"], f"{path}: run")
    if env is None:
        env = _environment(sections["environment"], f"{path}: environment", trust)
    return algorithm_of(sections["algorithm"], f"{path}: algorithm", env), run


def algorithm_from_yaml(path: Path, env: Environment) -> Algorithm:
    """Makes the algorithm of a configuration file in an environment; other sections are not looked at.

    Fields that the file does not give have their defaults.

    Raises:
        UserError: unreadable, or a field or value that is not valid; the line names it.
    """
    sections = _sections(path)
    if "algorithm" not in sections:
        raise UserError(f"{path}: needs a section algorithm")
    return algorithm_of(sections["algorithm"], f"{path}: algorithm", env)


def _sections(path: Path) -> dict[str, Any]:
    sections = read_yaml(path)
    if not isinstance(sections, dict):
        raise UserError(f"{path}: needs the sections algorithm, environment and run, and no others")
    return sections


def algorithm_of(section: Any, where: str, env: Environment) -> Algorithm:
    """Makes the algorithm that the section `algorithm` of a configuration file describes.

    Args:
        where: what an error calls the section.

    Raises:
        UserError: no name, or a field or value that is not valid.
    """
    name, fields = _named(section, where)
    try:
        kind = algorithm_class(name).config_class
        config = parse(kind, completed(kind(), fields), where)
        return make_algorithm(name, env, config)
    except UserError as error:
        raise UserError(_placed(where, str(error))) from error


def completed(default: Any, values: Any) -> Any:
    """Values with the fields that they leave out taken from a default, on every level.

    An algorithm's own defaults are not those of the dataclasses inside: its learner's discount is not
    `TD3Config`'s, and naming the learner's network must not change it.
    """
    if not (dataclasses.is_dataclass(default) and isinstance(values, dict)):
        return values
    whole = {field.name: getattr(default, field.name) for field in dataclasses.fields(default)}
    plain = {
        name: dataclasses.asdict(of) if dataclasses.is_dataclass(of) else of for name, of in whole.items()
    }
    return {**plain, **{name: completed(whole.get(name), value) for name, value in values.items()}}


def parse(kind: Any, values: Any, where: str) -> Any:
    """Builds a configuration dataclass from plain values.

    Raises:
        UserError: the first field that is unknown or whose value is not valid.
    """
    fields = [field.name for field in dataclasses.fields(kind)]
    if not isinstance(values, dict):
        raise UserError(f"{where}: needs fields, of " + ", ".join(fields))
    _refuse_unknown(kind, values, where)
    try:
        return pydantic.TypeAdapter(kind).validate_python(values)
    except UserError as error:
        raise UserError(f"{where}: {error}") from error
    except pydantic.ValidationError as error:
        first = error.errors()[0]
        place = ".".join([where, *(str(part) for part in first["loc"])])
        raise UserError(f"{place}: {first['msg']} (is {first['input']!r})") from error


def _refuse_unknown(kind: Any, values: dict[str, Any], where: str) -> None:
    fields = {field.name: field.type for field in dataclasses.fields(kind)}
    for name, value in values.items():
        if name not in fields:
            raise unknown_name(f"field in {where}", str(name), fields)
        if isinstance(value, dict) and dataclasses.is_dataclass(fields[name]):
            _refuse_unknown(fields[name], value, f"{where}.{name}")


def _environment(section: Any, where: str, trust: bool) -> Environment:
    name, fields = _named(section, where)
    place = fields.pop("class", None)
    try:
        if place is None:
            entry = registry.find(name) if ":" not in name else None
            if entry is None:
                raise UserError(f"name = {name}: an import path is given as class, beside a name")
        else:
            entry = _trusted(name, str(place), trust)
    except UserError as error:
        raise UserError(_placed(where, str(error))) from error
    if entry.config_class is None:
        return entry.with_fields(fields).make()
    config = parse(entry.config_class, fields, where)
    if not trust and (code := registry.foreign_code(config)):
        raise _untrusted(f"{where}: {code}")
    return dataclasses.replace(entry, config=config).make()


def _trusted(name: str, place: str, trust: bool) -> registry.Entry:
    """The environment at an import path, under the name that it was trained by."""
    if "<locals>" in place or place.startswith("__main__:"):
        raise UserError(
            f"class = {place}: cannot be imported from there; give the environment itself, "
            "skillcrew.Run(folder, env), or move its class to a module"
        )
    if not (trust or registry.is_offered(place)):
        raise _untrusted(f"class = {place}")
    return dataclasses.replace(registry.find(place), name=name)


def _untrusted(code: str) -> UserError:
    return UserError(
        f"{code}: code that neither skillcrew nor an installed package's entry point offers is "
        "imported only if you trust this folder: give --trust, or skillcrew.Run(folder, trust=True); or "
        "install the package that offers it"
    )


def _named(section: Any, where: str) -> tuple[str, dict[str, Any]]:
    if not isinstance(section, dict) or not isinstance(section.get("name"), str):
        raise UserError(f"{where}: needs a name")
    return section["name"], {field: value for field, value in section.items() if field != "name"}


def _placed(where: str, message: str) -> str:
    return message if message.startswith(where) else f"{where}: {message}"


def _plain(value: Any) -> Any:
    """Tuples as lists, mappings as dictionaries: what a safe YAML file can hold."""
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return value
