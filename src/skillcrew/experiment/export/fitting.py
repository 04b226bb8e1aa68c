"""Whether what a file says of a team fits together, found out before anything is made of it."""

from collections.abc import Callable, Mapping
from typing import Any

import equinox as eqx

from skillcrew.errors import UserError
from skillcrew.experiment.export.interface import Interface
from skillcrew.experiment.export.structure import parts_of, put_together
from skillcrew.policies.network import MLP
from skillcrew.policies.timetable import Timetable

Shape = tuple[int, ...]


def check_fits(plain: Any, shapes: Mapping[str, Any], interface: Interface) -> None:
    """Refuses a team whose arrays contradict each other, or what its file says that it sees and does.

    Nothing is computed, and no memory is taken.

    Args:
        plain: its structure, which `shapes_in` has passed.
        shapes: of its arrays, by name.

    Raises:
        UserError: the first contradiction.
    """
    found = _found(plain, shapes, interface)
    for said, true in zip(interface.all_ports, found.all_ports, strict=False):
        if said != true:
            raise UserError(f"{said.name} is {said.words}, and its arrays make it {true.words}")
    if len(interface.all_ports) != len(found.all_ports):
        raise UserError("it has another number of inputs and outputs than its arrays make")


def _found(plain: Any, shapes: Mapping[str, Any], interface: Interface) -> Interface:
    """What a team sees and does by its arrays."""
    try:
        team = put_together(plain, shapes)
        for name, part in parts_of(team):
            for kind, expected in EXPECTED.items():
                if type(part) is kind:
                    _check_shapes(name, part, expected)
        return Interface.of(team, interface.observation_shapes())
    except UserError:
        raise
    # Whatever JAX raises of shapes that cannot be multiplied, and Python of what is no number.
    except Exception as error:
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise UserError(f"its parts do not fit together ({reason})") from error


def _check_shapes(name: str, part: Any, expected: Callable[[Any], list[tuple[str, Shape, Shape]]]) -> None:
    try:
        pairs = expected(part)
    except (AttributeError, IndexError, TypeError, ValueError) as error:
        raise UserError(f"{name}: is no {type(part).__name__}") from error
    for field, found, wanted in pairs:
        if found != wanted:
            raise UserError(
                f"{name}/{field}: is {list(found)}, and beside the others has to be {list(wanted)}"
            )


def _mlp(part: MLP) -> list[tuple[str, Shape, Shape]]:
    weights = [_shape(weight) for weight in part.weights]
    biases = [_shape(bias) for bias in part.biases]
    lead, inputs = weights[0][:-2], weights[0][-2]
    pairs = []
    for layer, (weight, bias) in enumerate(zip(weights, biases, strict=True)):
        pairs.append((f"weights/{layer}", weight, (*lead, inputs, weight[-1])))
        pairs.append((f"biases/{layer}", bias, (*lead, weight[-1])))
        inputs = weight[-1]
    return pairs


def _unit(part: eqx.nn.GRUCell) -> list[tuple[str, Shape, Shape]]:
    lead, units = _shape(part.weight_ih)[:-2], part.hidden_size
    wanted = {
        "weight_ih": (*lead, 3 * units, part.input_size),
        "weight_hh": (*lead, 3 * units, units),
        "bias": (*lead, 3 * units),
        "bias_n": (*lead, units),
    }
    return [(field, _shape(getattr(part, field)), shape) for field, shape in wanted.items()]


def _timetable(part: Timetable) -> list[tuple[str, Shape, Shape]]:
    return [("lengths", _shape(part.lengths), _shape(part.scores)[:-1])]


def _shape(array: Any) -> Shape:
    return tuple(array.shape)


EXPECTED: dict[Any, Callable[[Any], list[tuple[str, Shape, Shape]]]] = {
    MLP: _mlp,
    eqx.nn.GRUCell: _unit,
    Timetable: _timetable,
}
"""Of what would broadcast where it should not: each array's name, its shape, and the one it has to have."""
