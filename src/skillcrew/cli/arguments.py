"""How values are written on the command line: counts, seeds, parent graphs, groups of types."""

import decimal
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import yaml

from skillcrew.envs.bridges.host_config import Argument
from skillcrew.errors import UserError
from skillcrew.experiment.trackers.names import check_names

MOST_SEEDS = 1000
"""More in one program is a slip of the keyboard."""


class Seeds(tuple[int, ...]):
    """Seeds as the command line writes them."""


class TrackerNames(tuple[str, ...]):
    """Trackers as the command line writes them."""


NO_TRACKERS = TrackerNames()


def parse_trackers(text: str) -> TrackerNames:
    """`tensorboard,wandb`; `none` for none.

    Raises:
        UserError: none of these.
    """
    names = TrackerNames(() if text == "none" else text.split(","))
    check_names(names)
    return names


def format_trackers(names: Sequence[str] | None) -> str:
    """The inverse of `parse_trackers`; what nobody has given has no words."""
    return "None" if names is None else ",".join(names) or "none"


def parse_count(text: str) -> int:
    """A whole number, also as `4e6` or `1_000`.

    Raises:
        UserError: no whole number.
    """
    try:
        number = decimal.Decimal(text)
        if number != number.to_integral_value() or abs(number) >= 2**63:
            raise ValueError
        return int(number)
    except (ValueError, OverflowError, decimal.InvalidOperation):
        raise UserError(f"'{text}': give a whole number, such as 500000 or 5e5") from None


def parse_seeds(text: str) -> Seeds:
    """`5` (the five seeds 0 to 4), `2000..2004` or `1,5,9`.

    Raises:
        UserError: none of these.
    """
    if re.fullmatch(r"\d+", text):
        count = int(text)
        if count < 1:
            raise UserError("--seeds 0: give at least one seed")
        _check_count(count, text, hint=f"; the seed {count} alone is {count}..{count}")
        return Seeds(range(count))
    if match := re.fullmatch(r"(\d+)\.\.(\d+)", text):
        first, last = int(match[1]), int(match[2])
        if last < first:
            raise UserError(f"--seeds {text}: the last seed is below the first")
        _check_count(last - first + 1, text)
        return Seeds(range(first, last + 1))
    if re.fullmatch(r"\d+(,\d+)+,?|\d+,", text):
        return Seeds(int(part) for part in text.split(",") if part)
    raise UserError(f"--seeds {text}: give a count (5), a range (2000..2004) or a list (1,5,9)")


def _check_count(count: int, text: str, hint: str = "") -> None:
    if count > MOST_SEEDS:
        raise UserError(f"--seeds {text}: {count} runs in one program; give at most {MOST_SEEDS}{hint}")


def parse_parents(text: str) -> dict[str, tuple[str, ...]] | None:
    """`B:A,C:A+B` for "B after A, and C after A and B"; `none` for no order at all.

    Raises:
        UserError: not of that form.
    """
    if text == "default":
        return None
    if text == "none":
        return {}
    graph = {}
    for part in text.split(","):
        match = re.fullmatch(r"(\w+):(\w+(?:\+\w+)*)", part.strip())
        if match is None:
            raise UserError(
                f"'{part}' in parents: write TYPE:PARENT or TYPE:PARENT+PARENT, such as B:A,C:A+B"
            )
        graph[match[1]] = tuple(match[2].split("+"))
    return graph


def format_parents(graph: Mapping[str, Sequence[str]] | None) -> str:
    """The inverse of `parse_parents`."""
    if graph is None:
        return "default"
    return ",".join(f"{name}:{'+'.join(above)}" for name, above in graph.items() if above) or "none"


def parse_groups(text: str) -> tuple[tuple[str, ...], ...]:
    """`A+B,C+D` for "A and B at once, and C and D at once"; `none` for no groups.

    Raises:
        UserError: not of that form.
    """
    if text == "none":
        return ()
    groups = []
    for part in text.split(","):
        if re.fullmatch(r"\w+(\+\w+)*", part.strip()) is None:
            raise UserError(f"'{part}' in simultaneous: write TYPE+TYPE, such as A+B,C+D, or none")
        groups.append(tuple(part.strip().split("+")))
    return tuple(groups)


def format_groups(groups: Sequence[Sequence[str]]) -> str:
    """The inverse of `parse_groups`."""
    return ",".join("+".join(group) for group in groups) or "none"


def parse_arguments(text: str) -> dict[str, Argument]:
    """`N=3,continuous_actions=true`; `none` for none.

    Raises:
        UserError: not of that form.
    """
    values = {}
    for name, value in _pairs(text, "arguments", "N=3,continuous_actions=true"):
        try:
            values[name] = yaml.safe_load(value)
        except yaml.YAMLError:
            values[name] = value
        if not isinstance(values[name], Argument):
            raise UserError(f"'{name}={value}' in arguments: give a number, a word, true, false or null")
    return values


def format_arguments(values: Mapping[str, Argument]) -> str:
    """The inverse of `parse_arguments`."""
    words = {True: "true", False: "false", None: "null"}
    shown = {
        name: words[value] if value is None or isinstance(value, bool) else value
        for name, value in values.items()
    }
    return ",".join(f"{name}={value}" for name, value in shown.items()) or "none"


def parse_skills(text: str) -> dict[str, str]:
    """`near=mylab.skills:near,far=mylab.skills:far`; `none` for none.

    Raises:
        UserError: not of that form.
    """
    return dict(_pairs(text, "skills", "near=mylab.skills:near"))


def format_skills(skills: Mapping[str, Any]) -> str:
    """The inverse of `parse_skills`."""
    return ",".join(f"{name}={path}" for name, path in skills.items()) or "none"


def _pairs(text: str, field: str, example: str) -> Iterator[tuple[str, str]]:
    for part in [] if text == "none" else text.split(","):
        name, equals, value = part.strip().partition("=")
        if not (name and equals and value):
            raise UserError(f"'{part}' in {field}: write NAME=VALUE, such as {example}, or none")
        yield name, value
