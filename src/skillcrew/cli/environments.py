"""Environments on the command line: their names, and their fields as options."""

import dataclasses
import functools
from collections.abc import Mapping
from typing import Any

from skillcrew.envs.registry import Entry, names


def environment_names() -> str:
    """All that are known by name, with commas between."""
    return ", ".join(names())


def with_environment(base: type, entry: Entry, more: Mapping[str, Any] | None = None) -> tuple[Any, Any]:
    """Options beside the fields of an environment, if it has any.

    Args:
        base: a dataclass of options, all with defaults.
        more: further fields, by name, with their defaults, which are dataclasses.

    Returns:
        A dataclass, and its default.
    """
    sections = {**(more or {}), **({} if entry.config_class is None else {"environment": entry.config})}
    options_class = _joined(base, tuple((name, type(default)) for name, default in sections.items()))
    return options_class, options_class(**sections)


@functools.cache
def _joined(base: type, sections: tuple[tuple[str, type], ...]) -> Any:
    """A dataclass of options with further fields, one for all commands, as tyro keeps each that it reads."""
    # Fields without a default cannot follow those of the base class unless they are keyword-only.
    return dataclasses.make_dataclass(
        "Options",
        [(name, kind, dataclasses.field()) for name, kind in sections],
        bases=(base,),
        frozen=True,
        kw_only=True,
    )


def configured(entry: Entry, options: Any) -> Entry:
    """An environment with the fields that were given as options."""
    return dataclasses.replace(entry, config=getattr(options, "environment", None))
