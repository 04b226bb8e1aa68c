"""Who survives and who becomes a parent."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, Key


def rank(fitness: Float[Array, " population"]) -> Int[Array, " population"]:
    """Indices of the individuals, the fittest first; equals keep their order."""
    return jnp.argsort(-fitness, stable=True).astype(jnp.int32)


def tournament(
    key: Key[Array, ""], fitness: Float[Array, " population"], winners: int, size: int
) -> Int[Array, " winners"]:
    """Winners of independent tournaments: each takes the fittest of `size` drawn with replacement."""
    entrants = jax.random.randint(key, (winners, size), 0, fitness.shape[0], dtype=jnp.int32)
    best = jnp.argmax(fitness[entrants], axis=1)
    return jnp.take_along_axis(entrants, best[:, None], axis=1)[:, 0]


def proportional(
    key: Key[Array, ""], fitness: Float[Array, " population"], winners: int
) -> Int[Array, " winners"]:
    """Draws with replacement, with probability proportional to fitness (thesis, section 3.2.2).

    Args:
        fitness: counts from 0 or, where the worst is below 0, from the worst, which is then not drawn; where
            all are equal there, all are equally likely.
    """
    weights = fitness - jnp.minimum(fitness.min(), 0.0) + jnp.finfo(fitness.dtype).tiny
    return jax.random.choice(key, fitness.shape[0], (winners,), p=weights / weights.sum()).astype(jnp.int32)
