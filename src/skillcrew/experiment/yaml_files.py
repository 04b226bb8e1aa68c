"""Reading YAML that anybody may have written: plain values of a bounded size, or one line of error."""

from pathlib import Path
from typing import Any

import yaml

from skillcrew.errors import UserError
from skillcrew.experiment.files import read_plain

MOST_NODES = 100_000
"""Values in one file, each counted as often as an alias repeats it."""
DEEPEST = 40
"""Levels of lists and mappings in each other."""

LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
"""The one in C reads a configuration in a tenth of the time; not every platform's package has it."""


def read_yaml(path: Path) -> Any:
    """The plain values of a file; no tag makes anything else of them.

    Raises:
        UserError: it cannot be read, is no YAML, or is nested or repeats itself beyond all measure.
    """
    try:
        text = read_plain(path)
        _check_depth(text)
        loader = LOADER(text)
        try:
            node = loader.get_single_node()
            _check_size(node)
            return None if node is None else loader.construct_document(node)
        finally:
            loader.dispose()
    # Of a tag that does not fit its text, the parser raises whatever Python does: KeyError, AttributeError.
    except Exception as error:
        raise UserError(f"{path}: cannot be read as YAML ({_reason(error)})") from error


def _check_depth(text: str) -> None:
    """Counts before anything is nested: the loader in C ends the process where levels are too many."""
    depth = 0
    for event in yaml.parse(text, Loader=LOADER):
        depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        if depth > DEEPEST:
            raise ValueError(f"more than {DEEPEST} levels of values")


def _check_size(root: yaml.Node | None) -> None:
    """Counts before anything is made: a few lines of aliases may stand for more than any memory holds."""
    left, waiting = MOST_NODES, [(root, 0)]
    while waiting:
        node, depth = waiting.pop()
        left -= 1
        if left < 0 or depth > DEEPEST:
            raise ValueError(f"more than {MOST_NODES:,} values, or {DEEPEST} levels of them")
        if isinstance(node, yaml.SequenceNode):
            waiting += [(inner, depth + 1) for inner in node.value]
        elif isinstance(node, yaml.MappingNode):
            waiting += [(inner, depth + 1) for pair in node.value for inner in pair]


def _reason(error: Exception) -> str:
    if isinstance(error, RecursionError):
        return f"more than {DEEPEST} levels of values"
    return str(error).splitlines()[0] if str(error) else type(error).__name__
