"""A team as a list of operations on named arrays, in NumPy's words."""

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np

from skillcrew.experiment.export.interface import Port


@dataclasses.dataclass(frozen=True)
class Node:
    """One operation: `output = numpy.word(*inputs, *attributes)`.

    Words that are not NumPy's: "cast" to a type, "slice" from starts to ends, "rows" by indices of the first
    axes. "concatenate" takes its arrays one by one, "einsum" its equation last.
    """

    word: str
    inputs: tuple[str, ...]
    attributes: tuple[Any, ...]
    output: str


@dataclasses.dataclass(frozen=True)
class Program:
    """What a team does in one step, in an order in which it can be computed."""

    inputs: tuple[Port, ...]
    draws: tuple[Port, ...]
    """Further inputs: numbers that are uniform between 0 and 1, where a team draws what it does."""
    nodes: tuple[Node, ...]
    constants: Mapping[str, np.ndarray]
    outputs: tuple[Port, ...]
    results: Mapping[str, str]
    """Which value each of the outputs is."""


def pruned(program: Program) -> Program:
    """Without what no result depends on."""
    needed = set(program.results.values())
    nodes = []
    for node in reversed(program.nodes):
        if node.output in needed:
            needed.update(node.inputs)
            nodes.append(node)
    constants = {name: array for name, array in program.constants.items() if name in needed}
    return dataclasses.replace(program, nodes=tuple(reversed(nodes)), constants=constants)
