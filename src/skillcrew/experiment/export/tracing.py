"""From a team's act, as JAX records it, to a `Program`."""

from collections.abc import Mapping
from typing import Any

import jax
import numpy as np

from skillcrew.experiment.export.interface import Interface
from skillcrew.experiment.export.operations import OPERATIONS
from skillcrew.experiment.export.program import Program, pruned
from skillcrew.experiment.export.symbols import Known, Symbol, as_value
from skillcrew.experiment.export.trace import Trace
from skillcrew.experiment.export.walking import walk


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
    trace = Trace(OPERATIONS)
    known = [Known(array, name) for name, array in weights.items()]
    made = walk(closed, [*known, *(Symbol(port) for port in ports), trace.key], trace.operate)
    names = (trace.name(as_value(value)) for value in made)
    results = {port.name: name for port, name in zip(interface.results, names, strict=True)}
    draws, nodes = tuple(trace.draws), tuple(trace.nodes)
    return pruned(Program(ports, draws, nodes, trace.constants, interface.results, results))
