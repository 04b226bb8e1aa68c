"""A team's act while it is written down, operation by operation."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from jax.extend.core import JaxprEqn

from skillcrew.experiment.export.interface import Port
from skillcrew.experiment.export.program import Node
from skillcrew.experiment.export.symbols import Bits, Known, Shaped, Symbol, as_value
from skillcrew.experiment.export.walking import compute

Values = Sequence[Any]
Params = Mapping[str, Any]
Operation = Callable[["Trace", Params, Values, Sequence[Shaped]], Values]
"""An operation's outputs, by its parameters, its inputs, and the shapes of its outputs."""


class Trace:
    """A program while it is written down.

    Args:
        operations: how each of JAX's operations is written down, by JAX's word for it.
    """

    key = object()
    """Stands for what random numbers are drawn with."""

    def __init__(self, operations: Mapping[str, Operation]) -> None:
        self._operations = operations
        self.nodes: list[Node] = []
        self.draws: list[Port] = []
        self.constants: dict[str, np.ndarray] = {}
        self._names: dict[Any, str] = {}

    def operate(self, operation: JaxprEqn, inputs: list[Any]) -> Sequence[Any]:
        """An operation's outputs: computed where all that it takes is known, else written down."""
        word = operation.primitive.name
        if word == "random_bits":
            return [self._draw(operation.params["shape"])]
        values: list[Any] = list(map(as_value, inputs))
        if all(isinstance(value, Known) for value in values):
            made = compute(operation, [value.array for value in values])
            return [Known(np.asarray(array)) for array in made]
        shapes: list[Any] = [out.aval for out in operation.outvars]
        return self._operations[word](self, operation.params, values, shapes)

    def emit(self, word: str, inputs: Sequence[Known | Symbol], like: Shaped, *attributes: Any) -> Symbol:
        """Writes one operation down, whose output has the shape and type of `like`."""
        output = Port(f"value/{len(self.nodes)}", tuple(like.shape), str(like.dtype))
        self.nodes.append(Node(word, tuple(map(self.name, inputs)), attributes, output.name))
        return Symbol(output)

    def name(self, value: Known | Symbol | Bits) -> str:
        """The name of a value among those of the program; what is known becomes a constant."""
        assert not isinstance(value, Bits)
        if isinstance(value, Symbol):
            return value.port.name
        array = np.asarray(value.array)
        content = (array.dtype.str, array.shape, array.tobytes())
        if content not in self._names:
            self._names[content] = value.name or f"constant/{len(self.constants)}"
            self.constants[self._names[content]] = array
        return self._names[content]

    def _draw(self, shape: tuple[int, ...]) -> Bits:
        number = len(self.draws)
        self.draws.append(Port(f"uniform/{number}" if number else "uniform", tuple(shape), "float32"))
        return Bits(Symbol(self.draws[-1]))
