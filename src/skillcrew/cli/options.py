"""Dataclasses to command line options, by tyro."""

import contextlib
import dataclasses
import io
import itertools
import shlex
import sys
import typing
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, TypeVar

import tyro
from tyro.constructors import ConstructorRegistry, PrimitiveConstructorSpec, PrimitiveTypeInfo

from skillcrew.cli.arguments import (
    Seeds,
    TrackerNames,
    format_arguments,
    format_groups,
    format_parents,
    format_skills,
    format_trackers,
    parse_arguments,
    parse_count,
    parse_groups,
    parse_parents,
    parse_seeds,
    parse_skills,
    parse_trackers,
)
from skillcrew.cli.things import format_things, parse_things
from skillcrew.envs.bridges.host_config import Argument, SkillReward
from skillcrew.envs.bridges.jaxmarl_config import Options as JAXMARL_OPTIONS
from skillcrew.envs.bridges.jaxmarl_config import Skills as JAXMARL_SKILLS
from skillcrew.errors import UserError, nearest_first
from skillcrew.experiment.origin import Origin

Options = TypeVar("Options")

registry = ConstructorRegistry()


def parse_options(
    kind: type[Options], words: Sequence[str], default: Any, called: Sequence[str], about: str
) -> Options:
    """Parses the words after a command into a dataclass.

    Args:
        default: an instance, whose values are the defaults that `--help` shows.
        called: the words before those, the first of which is the command.

    Raises:
        UserError: an unknown option, a value of the wrong type, or one that a dataclass refuses.
        SystemExit: after `--help`.
    """
    # As a shell would take it: tyro splits it, and a folder may be called anything.
    program = shlex.join(("skillcrew", *called))
    _refuse_unknown(kind, words, program)
    said = io.StringIO()
    try:
        with registry, contextlib.redirect_stderr(said):
            options = tyro.cli(kind, args=list(words), default=default, prog=program, description=about)
    except SystemExit as end:
        if not end.code:
            raise
        raise UserError(f"{_complaint(said.getvalue())}; `{program} --help` explains all options") from None
    sys.stderr.write(said.getvalue())
    return options


def _complaint(box: str) -> str:
    """What tyro says in a box between its title and its explanations, as one line."""

    def is_rule(line: str) -> bool:
        return not line.strip("─-")

    _, *lines = [line.strip("│╭╮╰╯ ") for line in box.splitlines()] or [""]
    # Where no box can be drawn, a rule stands below the title.
    said = itertools.takewhile(lambda line: not is_rule(line), itertools.dropwhile(is_rule, lines))
    return " ".join(said) or "these options cannot be read"


def _refuse_unknown(kind: type, words: Sequence[str], program: str) -> None:
    valid = {"--help", *option_names(kind)}
    for word in words:
        name = word.split("=")[0].replace("_", "-")
        if word.startswith("--") and name not in valid:
            near = ", ".join(nearest_first(name, sorted(valid))[:5])
            raise UserError(f"unknown option {name}; nearest: {near} (`{program} --help` lists all)")


def option_names(kind: Any) -> Iterator[str]:
    """All options of a dataclass, as they are written; a switch is there twice, on and off."""
    return (name for name, _ in option_fields(kind))


def option_fields(kind: Any, prefix: str = "--") -> Iterator[tuple[str, Any]]:
    """The same with the types of the fields behind them."""
    for field in dataclasses.fields(kind):
        last = field.name.replace("_", "-")
        if dataclasses.is_dataclass(field.type) and isinstance(field.type, type):
            yield from option_fields(field.type, f"{prefix}{last}.")
            continue
        yield f"{prefix}{last}", field.type
        if field.type is bool:
            yield f"{prefix}no-{last}", field.type


def _rule(applies: Callable[[Any], bool], metavar: str, parse: Callable, show: Callable) -> None:
    """Teaches tyro to read one type from a single word."""

    @registry.primitive_rule
    def rule(info: PrimitiveTypeInfo) -> PrimitiveConstructorSpec[Any] | None:
        return _of_one_word(metavar, parse, show) if applies(info.type) else None


def _of_one_word(metavar: str, parse: Callable, show: Callable) -> PrimitiveConstructorSpec[Any]:
    return PrimitiveConstructorSpec(
        nargs=1,
        metavar=metavar,
        instance_from_str=lambda words: parse(words[0]),
        is_instance=lambda value: True,
        str_from_instance=lambda value: [show(value)],
    )


def _kind_of_things(kind: Any) -> Any:
    """The dataclass of which a type holds a tuple, for `tuple[Thing, ...] | None`; else None."""
    held = [typing.get_args(part) for part in typing.get_args(kind) if typing.get_origin(part) is tuple]
    return next((of for of, *_ in held if isinstance(of, type) and dataclasses.is_dataclass(of)), None)


@registry.primitive_rule
def _things(info: PrimitiveTypeInfo) -> PrimitiveConstructorSpec[Any] | None:
    kind = _kind_of_things(info.type)
    if kind is None:
        return None
    first, second, *_ = (field.name for field in dataclasses.fields(kind))
    metavar = f"{first.upper()}:{second}=VALUE:FIELD=VALUE,…|none"
    return _of_one_word(metavar, lambda word: parse_things(word, kind), format_things)


_rule(
    lambda kind: kind == Origin | None,
    "RUN|none",
    lambda word: None if word == "none" else Origin(word),
    lambda origin: "none" if origin is None else origin.run,
)
_rule(lambda kind: kind is int, "INT", parse_count, str)
_rule(
    lambda kind: kind is Seeds,
    "COUNT|FIRST..LAST|A,B,C",
    parse_seeds,
    lambda seeds: ",".join(map(str, seeds)),
)
_rule(
    lambda kind: kind in (TrackerNames, TrackerNames | None),
    "tensorboard,wandb|none",
    parse_trackers,
    format_trackers,
)
_rule(
    lambda kind: kind == Mapping[str, tuple[str, ...]],
    "B:A,C:A+B|none|default",
    parse_parents,
    format_parents,
)
# With None: a default that is not empty would otherwise be taken apart into an option for each group.
_rule(lambda kind: kind == tuple[tuple[str, ...], ...] | None, "A+B,C+D|none", parse_groups, format_groups)
_rule(
    lambda kind: kind in (Mapping[str, Argument], JAXMARL_OPTIONS),
    "NAME=VALUE,…|none",
    parse_arguments,
    format_arguments,
)
_rule(
    lambda kind: kind in (Mapping[str, SkillReward | str], JAXMARL_SKILLS),
    "NAME=MODULE:NAME,…|none",
    parse_skills,
    format_skills,
)
