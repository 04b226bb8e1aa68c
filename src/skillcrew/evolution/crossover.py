"""Recombination of two parents."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Key


def single_point(
    key: Key[Array, ""], first: Float[Array, "children genes"], second: Float[Array, "children genes"]
) -> Float[Array, "children genes"]:
    """Each child has the first parent's genes before a random cut and the second's after it.

    The cut leaves at least one gene of each parent.
    """
    children, genes = first.shape
    cut = jax.random.randint(key, (children, 1), 1, max(genes, 2))
    return jnp.where(jnp.arange(genes)[None, :] < cut, first, second)
