"""Actions that differ from those that a policy would take, to learn from."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, Key


def with_noise(
    key: Key[Array, ""], action: Float[Array, "*any"], deviation: Float[Array, ""] | float
) -> Float[Array, "*any"]:
    """Continuous actions with Gaussian noise, clipped to [-1, 1]."""
    return jnp.clip(action + deviation * jax.random.normal(key, action.shape), -1.0, 1.0)


def with_random_ones(
    key: Key[Array, ""], action: Int[Array, "*any"], probability: Float[Array, ""] | float, choices: int
) -> Int[Array, "*any"]:
    """Discrete actions of which each is, so likely, replaced by any of them (ε-greedy)."""
    drawn, other = jax.random.uniform(key, (2, *action.shape))
    return jnp.where(drawn < probability, jnp.floor(other * choices).astype(jnp.int32), action)
