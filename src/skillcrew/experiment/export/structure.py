"""Teams as plain values that say what they are made of, beside named arrays; and back, without pickles."""

import dataclasses
import math
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import equinox as eqx
import jax
import numpy as np

from skillcrew.envs.agent_type import AgentType
from skillcrew.errors import UserError, unknown_name
from skillcrew.policies.action_values import ActionValues
from skillcrew.policies.actor import Actor
from skillcrew.policies.heads import MultiHead
from skillcrew.policies.memory import MemoryNetwork
from skillcrew.policies.network import MLP
from skillcrew.policies.selector import HoldingSelector, Selector
from skillcrew.policies.stochastic import Options, StochasticPolicy, StochasticTeam
from skillcrew.policies.team import ActorTeam, IdentifiedTeam, JointTeam, SkillTeam
from skillcrew.policies.team_by_type import TeamByType
from skillcrew.policies.timetable import Timetable, TimetableSelector

TEAMS = (SkillTeam, ActorTeam, JointTeam, IdentifiedTeam, StochasticTeam, TeamByType)
SELECTORS = (Selector, HoldingSelector, TimetableSelector, Timetable, StochasticPolicy)
NETWORKS = (MemoryNetwork, MLP, MultiHead, Actor, ActionValues, eqx.nn.GRUCell)
KINDS = {kind.__name__: kind for kind in (*TEAMS, *SELECTORS, *NETWORKS, Options, AgentType)}
"""What teams are made of. Nothing else is ever made of a file."""

DTYPES = ("float32", "int32", "bool")

LARGEST = 2**20
"""Of any number in a structure, such as the length of an axis."""

MOST_AXES, MOST_NUMBERS = 8, 2**28
"""Of one array."""

ROOT = "policy"
"""What the names of all arrays begin with."""


def taken_apart(value: Any, name: str = ROOT) -> tuple[Any, dict[str, np.ndarray]]:
    """A team, or a part of one, as plain values and the arrays that they name by their places.

    Raises:
        UserError: it holds what no file could be read back into.
    """
    if value is None or isinstance(value, bool | int | float | str):
        return value, {}
    if isinstance(value, np.ndarray | jax.Array):
        array = np.asarray(value)
        return {"shape": list(array.shape), "dtype": str(array.dtype)}, {name: array}
    arrays: dict[str, np.ndarray] = {}

    def part(own: Any, place: str | int) -> Any:
        plain, found = taken_apart(own, f"{name}/{place}")
        arrays.update(found)
        return plain

    if isinstance(value, tuple):
        return [part(own, index) for index, own in enumerate(value)], arrays
    kind = type(value).__name__
    if KINDS.get(kind) is not type(value):
        raise UserError(f"{name}: is a {kind}, and no team of such can be exported; see docs/export.md")
    fields = (field.name for field in dataclasses.fields(value))
    return {"kind": kind, **{field: part(getattr(value, field), field) for field in fields}}, arrays


def shapes_in(plain: Any) -> dict[str, jax.ShapeDtypeStruct]:
    """Shapes of the arrays that a structure names.

    Raises:
        UserError: it is no structure of a team; the line names the place.
    """
    return {name: shape for name, shape in _walk(plain, ROOT) if shape is not None}


def shape_of(plain: dict[str, Any], name: str) -> jax.ShapeDtypeStruct:
    """The shape that plain values say of an array.

    Raises:
        UserError: they say none, or one that is beyond all measure.
    """
    shape, dtype = plain.get("shape"), plain.get("dtype")
    if set(plain) != {"shape", "dtype"} or not isinstance(shape, list) or dtype not in DTYPES:
        raise UserError(f"{name}: an array needs a shape, and a dtype among {', '.join(DTYPES)}")
    if any(isinstance(length, bool) or not isinstance(length, int) or length < 0 for length in shape):
        raise UserError(f"{name}: its shape is {shape}, which are no lengths")
    if len(shape) > MOST_AXES or max(shape, default=0) > LARGEST or math.prod(shape) > MOST_NUMBERS:
        raise UserError(f"{name}: its shape is {shape}, larger than in any team")
    return jax.ShapeDtypeStruct(tuple(shape), np.dtype(dtype))


def put_together(plain: Any, arrays: Mapping[str, Any]) -> Any:
    """The team of a structure.

    Args:
        plain: one that `shapes_in` has passed.
        arrays: by their names, or what stands for them.

    Raises:
        Exception: of any kind, where fields have values that their classes do not take.
    """
    return _put(plain, ROOT, lambda name: arrays[name])


def parts_of(value: Any, name: str = ROOT) -> Iterator[tuple[str, Any]]:
    """A team and all modules inside it, with their places."""
    if isinstance(value, tuple):
        for index, own in enumerate(value):
            yield from parts_of(own, f"{name}/{index}")
    elif type(value) in KINDS.values():
        yield name, value
        for field in dataclasses.fields(value):
            yield from parts_of(getattr(value, field.name), f"{name}/{field.name}")


def _walk(plain: Any, name: str) -> Iterator[tuple[str, jax.ShapeDtypeStruct | None]]:
    if isinstance(plain, list):
        for index, own in enumerate(plain):
            yield from _walk(own, f"{name}/{index}")
    elif isinstance(plain, dict) and "kind" in plain:
        _check_fields(plain, name)
        for field, own in plain.items():
            if field != "kind":
                yield from _walk(own, f"{name}/{field}")
    elif isinstance(plain, dict):
        yield name, shape_of(plain, name)
    elif isinstance(plain, int | float) and not abs(plain) <= LARGEST:
        raise UserError(f"{name} = {plain}: no number in a team is larger than {LARGEST}")
    elif not (plain is None or isinstance(plain, bool | int | float | str)):
        raise UserError(f"{name}: is no part of a team")
    else:
        yield name, None


def _check_fields(plain: dict[str, Any], name: str) -> None:
    kind = str(plain["kind"])
    if kind not in KINDS:
        raise unknown_name(f"kind in {name}", kind, KINDS)
    fields = {field.name for field in dataclasses.fields(KINDS[kind])}
    if fields != set(plain) - {"kind"}:
        raise UserError(f"{name}: a {kind} needs the fields {', '.join(sorted(fields))}, and no others")


def _put(plain: Any, name: str, array: Callable[[str], Any]) -> Any:
    if isinstance(plain, list):
        return tuple(_put(own, f"{name}/{index}", array) for index, own in enumerate(plain))
    if not isinstance(plain, dict):
        return plain
    if "kind" not in plain:
        return array(name)
    fields = {field: _put(own, f"{name}/{field}", array) for field, own in plain.items() if field != "kind"}
    kind = KINDS[str(plain["kind"])]
    if not issubclass(kind, eqx.Module):
        return kind(**fields)
    # As Equinox does it for trees that were mapped: weights have leading axes that no `__init__` knows.
    module = object.__new__(kind)
    for field, value in fields.items():
        object.__setattr__(module, field, value)
    return module
