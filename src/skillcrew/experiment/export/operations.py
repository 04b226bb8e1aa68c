"""JAX's operations in NumPy's words: those that policies are made of."""

import string
from collections.abc import Callable, Sequence
from typing import Any

import jax
import numpy as np

from skillcrew.experiment.export.elementary import erf_inv, scattered
from skillcrew.experiment.export.symbols import Bits, Known, Shaped, Symbol
from skillcrew.experiment.export.trace import Operation, Params, Trace, Values
from skillcrew.experiment.export.walking import walk

ALIKE = {
    "add": "add",
    "sub": "subtract",
    "mul": "multiply",
    "div": "divide",
    "rem": "fmod",
    "max": "maximum",
    "min": "minimum",
    "neg": "negative",
    "sign": "sign",
    "abs": "abs",
    "sqrt": "sqrt",
    "ceil": "ceil",
    "exp": "exp",
    "log": "log",
    "tanh": "tanh",
    "and": "logical_and",
    "eq": "equal",
    "gt": "greater",
    "ge": "greater_equal",
    "lt": "less",
}
"""The same element by element, under another name."""

ONE, HALF, INFINITY = (Known(np.float32(value)) for value in (1, 0.5, np.inf))


def _alike(word: str) -> Operation:
    return lambda trace, params, values, out: [trace.emit(word, values, out[0])]


def _unchanged(trace: Trace, params: Params, values: Values, out: Sequence[Shaped]) -> Values:
    return values


def _reshape(trace: Trace, params: Params, values: Values, out: Sequence[Shaped]) -> Values:
    return [_in_shape(trace, values[0], out[0].shape)]


def _in_shape(trace: Trace, value: Symbol, shape: tuple[int, ...]) -> Symbol:
    if value.shape == shape:
        return value
    return trace.emit("reshape", [value], jax.ShapeDtypeStruct(shape, value.dtype), list(shape))


def _broadcast(trace: Trace, params: Params, values: Values, out: Sequence[Shaped]) -> Values:
    lengths = dict(zip(params["broadcast_dimensions"], values[0].shape, strict=True))
    placed = _in_shape(trace, values[0], tuple(lengths.get(axis, 1) for axis in range(len(out[0].shape))))
    if placed.shape == out[0].shape:
        return [placed]
    return [trace.emit("broadcast_to", [placed], out[0], list(out[0].shape))]


def _transpose(trace: Trace, params: Params, values: Values, out: Sequence[Shaped]) -> Values:
    return [trace.emit("transpose", values, out[0], list(params["permutation"]))]


def _cast(trace: Trace, params: Params, values: Values, out: Sequence[Shaped]) -> Values:
    if values[0].dtype == out[0].dtype:
        return values
    return [trace.emit("cast", values, out[0], str(out[0].dtype))]


def _select(trace: Trace, params: Params, values: Values, out: Sequence[Shaped]) -> Values:
    which, if_not, if_so = values
    return [trace.emit("where", [which, if_so, if_not], out[0])]


def _reduce(word: str) -> Operation:
    def reduce(trace: Trace, params: Params, values: Values, out: Sequence[Shaped]) -> Values:
        (axis,) = params["axes"]
        return [trace.emit(word, values, out[0], axis)]

    return reduce


def _argmax(trace: Trace, params: Params, values: Values, out: Sequence[Shaped]) -> Values:
    (axis,) = params["axes"]
    place = trace.emit("argmax", values, jax.ShapeDtypeStruct(out[0].shape, np.int32), axis)
    return [trace.emit("cast", [place], out[0], str(out[0].dtype))]


def _concatenate(trace: Trace, params: Params, values: Values, out: Sequence[Shaped]) -> Values:
    return [trace.emit("concatenate", values, out[0], params["dimension"])]


def _slice(trace: Trace, params: Params, values: Values, out: Sequence[Shaped]) -> Values:
    starts, ends = params["start_indices"], params["limit_indices"]
    return [trace.emit("slice", values, out[0], list(starts), list(ends))]


def _split(trace: Trace, params: Params, values: Values, out: Sequence[Shaped]) -> Values:
    axis, parts = params["axis"], []
    starts, ends = [0] * len(values[0].shape), list(values[0].shape)
    for size, shape in zip(params["sizes"], out, strict=True):
        ends[axis] = starts[axis] + size
        parts.append(trace.emit("slice", values, shape, list(starts), list(ends)))
        starts[axis] = ends[axis]
    return parts


def _pad(trace: Trace, params: Params, values: Values, out: Sequence[Shaped]) -> Values:
    widths = [[before, behind] for before, behind, _ in params["padding_config"]]
    return [trace.emit("pad", values[:1], out[0], widths)]


def _dot(trace: Trace, params: Params, values: Values, out: Sequence[Shaped]) -> Values:
    (left, right), (left_batch, right_batch) = params["dimension_numbers"]
    letters = iter(string.ascii_lowercase)
    one = {axis: next(letters) for axis in range(len(values[0].shape))}
    same = dict(zip((*right, *right_batch), (*left, *left_batch), strict=True))
    two = {axis: one[same[axis]] if axis in same else next(letters) for axis in range(len(values[1].shape))}
    rest = [one[axis] for axis in one if axis not in (*left, *left_batch)]
    rest += [two[axis] for axis in two if axis not in same]
    result = [*(one[axis] for axis in left_batch), *rest]
    equation = f"{''.join(one.values())},{''.join(two.values())}->{''.join(result)}"
    return [trace.emit("einsum", values, out[0], equation)]


def _gather(trace: Trace, params: Params, values: Values, out: Sequence[Shaped]) -> Values:
    """Whole rows, by an index for each of the first axes."""
    whole, index = values
    of = params["dimension_numbers"]
    axes = tuple(range(index.shape[-1]))
    rows = (*(1 for _ in axes), *whole.shape[len(axes) :])
    behind = tuple(range(len(index.shape) - 1, len(out[0].shape)))
    found = (of.start_index_map, of.collapsed_slice_dims, tuple(params["slice_sizes"]), of.offset_dims)
    assert found == (axes, axes, rows, behind), params
    index = trace.emit("cast", [index], jax.ShapeDtypeStruct(index.shape, np.int32), "int64")
    return [trace.emit("rows", [whole, index], out[0])]


def _not_equal(trace: Trace, params: Params, values: Values, out: Sequence[Shaped]) -> Values:
    return [trace.emit("logical_not", [trace.emit("equal", values, out[0])], out[0])]


def _is_finite(trace: Trace, params: Params, values: Values, out: Sequence[Shaped]) -> Values:
    return [trace.emit("less", [trace.emit("abs", values, values[0]), INFINITY], out[0])]


def _log1p(trace: Trace, params: Params, values: Values, out: Sequence[Shaped]) -> Values:
    return [trace.emit("log", [trace.emit("add", [values[0], ONE], out[0])], out[0])]


def _logistic(trace: Trace, params: Params, values: Values, out: Sequence[Shaped]) -> Values:
    """By tanh, which has no exponential that could overflow."""
    value = trace.emit("tanh", [trace.emit("multiply", [HALF, values[0]], out[0])], out[0])
    return [trace.emit("add", [HALF, trace.emit("multiply", [HALF, value], out[0])], out[0])]


def _by(function: Callable[..., Any]) -> Operation:
    """What is made of more elementary operations."""

    def operate(trace: Trace, params: Params, values: Values, out: Sequence[Shaped]) -> Values:
        like = [jax.ShapeDtypeStruct(value.shape, value.dtype) for value in values]
        return walk(jax.make_jaxpr(function)(*like), values, trace.operate)

    return operate


def _bits_as_they_are(trace: Trace, params: Params, values: Values, out: Sequence[Shaped]) -> Values:
    """Of random bits, those that become digits; they stay what they stand for."""
    return [value for value in values if isinstance(value, Bits)]


def _bits_as_numbers(trace: Trace, params: Params, values: Values, out: Sequence[Shaped]) -> Values:
    """JAX draws numbers between 1 and 2, and then takes 1 away."""
    return [trace.emit("add", [values[0].uniform, ONE], out[0])]


OPERATIONS: dict[str, Operation] = {
    **{theirs: _alike(word) for theirs, word in ALIKE.items()},
    "stop_gradient": _unchanged,
    "reshape": _reshape,
    "squeeze": _reshape,
    "broadcast_in_dim": _broadcast,
    "transpose": _transpose,
    "convert_element_type": _cast,
    "select_n": _select,
    "reduce_sum": _reduce("sum"),
    "reduce_max": _reduce("max"),
    "reduce_min": _reduce("min"),
    "argmax": _argmax,
    "concatenate": _concatenate,
    "slice": _slice,
    "split": _split,
    "pad": _pad,
    "dot_general": _dot,
    "gather": _gather,
    "scatter": _by(scattered),
    "ne": _not_equal,
    "is_finite": _is_finite,
    "log1p": _log1p,
    "logistic": _logistic,
    "erf_inv": _by(erf_inv),
    "shift_right_logical": _bits_as_they_are,
    "or": _bits_as_they_are,
    "bitcast_convert_type": _bits_as_numbers,
}
"""By JAX's words."""
