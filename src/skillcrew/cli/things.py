"""Lists of dataclasses, such as types of rovers, as a single word on the command line."""

import dataclasses
import typing
from collections.abc import Sequence
from typing import Any

from skillcrew.cli.arguments import parse_count
from skillcrew.errors import UserError, unknown_name


def parse_things(text: str, kind: Any) -> tuple[Any, ...]:
    """`scout:rovers=2:coupling=1,hauler:rovers=1` for a list of two; `none` for an empty one.

    Args:
        kind: the dataclass of each; what stands first is its first field.

    Raises:
        UserError: not of that form, or a field or value that the dataclass refuses.
    """
    return () if text == "none" else tuple(_parse_thing(part.strip(), kind) for part in text.split(","))


def _parse_thing(text: str, kind: Any) -> Any:
    first, *others = dataclasses.fields(kind)
    types = {field.name: field.type for field in others}
    name, *settings = text.split(":")
    given: dict[str, Any] = {first.name: name}
    for setting in settings:
        field, equals, value = setting.partition("=")
        if not equals:
            raise UserError(f"'{setting}' in {text}: write FIELD=VALUE, such as {others[0].name}=2")
        if field not in types:
            raise unknown_name(f"field of {name}", field, types)
        given[field] = _parse_field(f"{name}: {field}", value, types[field])
    for field in others:
        if field.default is dataclasses.MISSING and field.name not in given:
            raise UserError(f"'{text}': give {field.name} too, such as {name}:{field.name}=2")
    return kind(**given)


def _parse_field(field: str, text: str, kind: Any) -> Any:
    kinds = typing.get_args(kind) or (kind,)
    if text == "none" and type(None) in kinds:
        return None
    if int in kinds:
        return parse_count(text)
    if float not in kinds:
        return text
    try:
        return float(text)
    except ValueError:
        raise UserError(f"{field} = {text}: give a number") from None


def format_things(things: Sequence[Any]) -> str:
    """The inverse of `parse_things`; what is at its default is left out."""
    return ",".join(map(_format_thing, things)) or "none"


def _format_thing(thing: Any) -> str:
    first, *others = dataclasses.fields(thing)
    values = {field: getattr(thing, field.name) for field in others}
    words = [
        f"{field.name}={'none' if value is None else value}"
        for field, value in values.items()
        if value != field.default
    ]
    return ":".join([getattr(thing, first.name), *words])
