"""JAX's own record of a function, walked through operation by operation."""

from collections.abc import Callable, Sequence
from typing import Any

import jax
import numpy as np
from jax.extend.core import ClosedJaxpr, JaxprEqn, Literal

INSIDE = {
    "jit": "jaxpr",
    "pjit": "jaxpr",
    "custom_jvp_call": "call_jaxpr",
    "custom_vmap_call": "call",
}
"""Operations that are functions themselves, and the parameter that holds what they do."""

Operate = Callable[[JaxprEqn, list[Any]], Sequence[Any]]


def walk(closed: ClosedJaxpr, inputs: Sequence[Any], operate: Operate) -> list[Any]:
    """Goes through all operations in order, with whatever values `operate` makes of values.

    Args:
        inputs: values of the function's inputs.
        operate: an operation's outputs, by its inputs. Constants come as JAX's arrays.
    """
    values = dict(zip(closed.jaxpr.constvars, closed.consts, strict=True))
    values |= dict(zip(closed.jaxpr.invars, inputs, strict=True))

    def value(of: Any) -> Any:
        return np.asarray(of.val, of.aval.dtype) if isinstance(of, Literal) else values[of]

    for operation in closed.jaxpr.eqns:
        taken = [value(of) for of in operation.invars]
        inside = INSIDE.get(operation.primitive.name)
        made = walk(operation.params[inside], taken, operate) if inside else operate(operation, taken)
        values |= dict(zip(operation.outvars, made, strict=True))
    return [value(of) for of in closed.jaxpr.outvars]


def compute(operation: JaxprEqn, inputs: list[Any]) -> Sequence[Any]:
    """An operation's outputs as JAX computes them."""
    made = operation.primitive.bind(*inputs, **operation.params)
    return made if operation.primitive.multiple_results else [made]


def plain(function: Callable[..., Any], *like: Any) -> Callable[..., list[Any]]:
    """A function of arrays as its operations alone, without rules of its own for batches.

    Those of ours look at how large a batch is, which a function that is exported for any batch does not know.

    Args:
        like: shapes of its inputs.
    """
    closed = jax.make_jaxpr(function)(*like)
    return lambda *inputs: walk(closed, inputs, compute)
