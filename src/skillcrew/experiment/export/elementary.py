"""Operations that NumPy and ONNX lack, in more elementary ones."""

from collections.abc import Sequence

import jax.numpy as jnp
from jaxtyping import Array, Float, Int

CENTRAL = (
    *(2.81022636e-08, 3.43273939e-07, -3.5233877e-06, -4.39150654e-06, 0.00021858087),
    *(-0.00125372503, -0.00417768164, 0.246640727, 1.50140941),
)
TAIL = (
    *(-0.000200214257, 0.000100950558, 0.00134934322, -0.00367342844, 0.00573950773),
    *(-0.0076224613, 0.00943887047, 1.00167406, 2.83297682),
)


def erf_inv(x: Float[Array, "*any"]) -> Float[Array, "*any"]:
    """The inverse of the error function to single precision (Giles 2012)."""
    w = -jnp.log((1 - x) * (1 + x))
    tail = _polynomial(TAIL, jnp.sqrt(jnp.maximum(w, 5.0)) - 3)
    return jnp.where(w < 5, _polynomial(CENTRAL, w - 2.5), tail) * x


def scattered(row: Int[Array, " all"], index: Int[Array, "some one"], numbers: Int[Array, " some"]) -> Array:
    """`row.at[index].set(numbers)`, no two of them at the same place."""
    here = index == jnp.arange(len(row), dtype=index.dtype)[None, :]
    placed = jnp.where(here, numbers[:, None], 0).sum(0, dtype=row.dtype)
    return jnp.where(here.sum(0, dtype=jnp.int32) > 0, placed, row)


def _polynomial(coefficients: Sequence[float], x: Array) -> Array:
    value = coefficients[0]
    for coefficient in coefficients[1:]:
        value = value * x + coefficient
    return jnp.asarray(value)
