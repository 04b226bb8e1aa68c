"""From a team's act, as JAX records it, to a `Program`."""

from collections.abc import Mapping, Sequence
from typing import Any

import jax
import numpy as np
from jax.extend.core import JaxprEqn

from skillcrew.experiment.export.interface import Interface, Port
from skillcrew.experiment.export.operations import OPERATIONS
from skillcrew.experiment.export.program import Node, Program, pruned
from skillcrew.experiment.export.symbols import Bits, Known, Shaped, Symbol, as_value
from skillcrew.experiment.export.walking import compute, walk


def program_of(team: Any, weights: Mapping[str, np.ndarray], interface: Interface) -> Program:
    """A team's act of one world.

    What depends on weights alone, such as when the phases of a timetable end, is computed here.

    Args:
        weights: all arrays of the team, as `taken_apart` names and orders them.

    Raises:
        KeyError: it does something for which there is no operation yet; tests see to it that no team of ours
            does.
    """
    leaves, structure = jax.tree.flatten(team)
    ports = (*interface.observation, *interface.memory)

    def play(own: list[Any], *inputs: Any) -> list[Any]:
        return interface.play(jax.tree.unflatten(structure, own), inputs[:-1], inputs[-1])

    key = jax.eval_shape(lambda: jax.random.key(0))
    closed = jax.make_jaxpr(play)(leaves, *(port.struct for port in ports), key)
    trace = Trace()
    known = [Known(array, name) for name, array in weights.items()]
    made = walk(closed, [*known, *(Symbol(port) for port in ports), trace.key], trace.operate)
    names = (trace.name(as_value(value)) for value in made)
    results = {port.name: name for port, name in zip(interface.results, names, strict=True)}
    draws, nodes = tuple(trace.draws), tuple(trace.nodes)
    return pruned(Program(ports, draws, nodes, trace.constants, interface.results, results))


class Trace:
    """A program while it is written down."""

    key = object()
    """Stands for what random numbers are drawn with."""

    def __init__(self) -> None:
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
        return OPERATIONS[word](self, operation.params, values, shapes)

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
