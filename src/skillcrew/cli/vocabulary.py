"""What can be said on the command line: commands, what stands at their places, options and their values."""

import dataclasses
import importlib
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any, get_args

from skillcrew.algorithms.registry import ALGORITHMS, algorithm_class
from skillcrew.cli.options import option_fields
from skillcrew.envs.registry import Domain, domains
from skillcrew.envs.registry import names_of as all_names_of
from skillcrew.experiment import figures
from skillcrew.experiment.origin import Origin

FOLDER, FILE, FLAG, LIST = "@folder", "@file", "@flag", "@list"
"""Words that stand for any folder, any file, no value at all, and for several with commas between."""

SHELLS = ("bash", "zsh", "fish")


@dataclasses.dataclass(frozen=True)
class Vocabulary:
    """Tables from what stands on a line to the words that may follow; keys may stand for several."""

    place: Mapping[tuple[str, ...], str]
    """By `COMMAND NUMBER`, or `commands` for the first place: the words for it, or what they stand for."""
    at: Mapping[tuple[str, ...], str]
    """By `COMMAND` or `COMMAND NUMBER WORD`: the options that it brings."""
    value: Mapping[tuple[str, ...], str]
    """By option: what its value may be; options that take any number or word are left out."""


def vocabulary(commands: Mapping[str, str]) -> Vocabulary:
    """Of all that is installed; imports every algorithm.

    Args:
        commands: what is said of each, by name.
    """
    place: dict[tuple[str, ...], str] = {("commands",): " ".join([*commands, "--help", "--version"])}
    at: dict[tuple[str, ...], str] = {}
    fields: dict[str, Any] = {}
    offered = domains()[0]
    words = _words_at_places(offered)
    for command in commands:
        module = importlib.import_module(f"skillcrew.cli.{command}")
        own = _options_of(module)
        fields.update(own)
        mentioned = re.findall(r"--[a-z][a-z-]*(?![\w.-])", _usage(module))
        at[(command,)] = " ".join(dict.fromkeys([*own, *mentioned, "--help"]))
        for number, name in enumerate(_places(module), start=2):
            place[(f"{command} {number}",)] = words.get(name, FILE)
            for said, kind in _sections(name, offered):
                section = dict(option_fields(kind, f"--{name.lower()}."))
                fields.update(section)
                at[tuple(f"{command} {number} {word}" for word in said)] = " ".join(section)
    return Vocabulary(place, at, _values(fields))


def _usage(module: ModuleType) -> str:
    return module.USAGE if hasattr(module, "USAGE") else module.usage()


def _places(module: ModuleType) -> list[str]:
    """The words in capitals of the usage's first line, in front of the options."""
    line, *_ = _usage(module).splitlines()
    return re.findall(r"\b[A-Z]+\b", line.partition("[OPTIONS]")[0])


def _options_of(module: ModuleType) -> dict[str, Any]:
    """The fields of a command's options, by how they are written; empty where it has no dataclass of them."""
    own = (kind for kind in vars(module).values() if getattr(kind, "__module__", None) == module.__name__)
    kind = next((kind for kind in own if kind.__name__.endswith("Options")), None)
    return dict(option_fields(kind)) if kind else {}


def _words_at_places(offered: list[Domain]) -> dict[str, str]:
    return {
        "ALGORITHM": " ".join(ALGORITHMS),
        "METHODS": LIST + " ".join(ALGORITHMS),
        "ENVIRONMENT": " ".join(name for domain in offered for name in _names_of(domain)),
        "FIGURE": " ".join((*figures.SETS, *figures.FIGURES, *figures.environments())),
        "RUN": FOLDER,
        "RUNS": FOLDER,
        "SHELL": " ".join(SHELLS),
    }


def _names_of(domain: Domain) -> list[str]:
    """Without those that a shell might take for more than a word; they are another package's."""
    return [name for name in all_names_of(domain) if re.fullmatch(r"[\w.+/-]+", name)]


def _sections(place: str, offered: list[Domain]) -> Iterator[tuple[list[str], type]]:
    """The words of a place that bring options of their own, and the dataclass of these."""
    if place == "ALGORITHM":
        for name in ALGORITHMS:
            yield [name], algorithm_class(name).config_class
    elif place == "ENVIRONMENT":
        for domain in offered:
            if domain.config_class:
                yield _names_of(domain), domain.config_class


def _values(fields: Mapping[str, Any]) -> dict[tuple[str, ...], str]:
    options: dict[str, list[str]] = {}
    for option, kind in fields.items():
        if words := _value(kind):
            options.setdefault(words, []).append(option)
    flags = [*options.get(FLAG, []), "--help", "--version"]
    return {tuple(names): words for words, names in {**options, FLAG: flags}.items()}


def _value(kind: Any) -> str:
    """The words for a value of a type, or what it stands for; empty where it may be anything."""
    if kind is bool:
        return FLAG
    kinds = get_args(kind) or (kind,)
    if Path in kinds:
        return FILE
    if Origin in kinds:
        return FOLDER
    return " ".join(str(word) for part in (kind, *kinds) for word in _literals(part))


def _literals(kind: Any) -> tuple[Any, ...]:
    return tuple(word for word in get_args(kind) if isinstance(word, str))
