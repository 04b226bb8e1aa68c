"""Work that is really skipped, also under `vmap`."""

from collections.abc import Callable
from typing import TypeVar

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, PyTree

Operand = TypeVar("Operand", bound=PyTree)


def run_unless(skip: Bool[Array, ""], function: Callable[[Operand], Operand], operand: Operand) -> Operand:
    """`function(operand)`, or the operand itself where `skip`.

    `jax.lax.cond` becomes a select under `vmap` and would pay for the work of every lane; a loop
    that runs at most once is skipped as soon as all lanes skip.
    """
    done, result = jax.lax.while_loop(
        lambda carry: ~carry[0], lambda carry: (jnp.ones_like(carry[0]), function(carry[1])), (skip, operand)
    )
    del done
    return result
