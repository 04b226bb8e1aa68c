"""How a reactive network's weights change: some by a little, or a few of them to another value, a rule."""

from collections.abc import Sequence

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Key

TAKEN_AWAY = 0.25
"""Probability that rules are taken away, and not given."""


def nudge(
    keys: Sequence[Key[Array, ""]],
    weights: Float[Array, "networks weights"],
    share: Float[Array, ""] | float,
    deviation: Float[Array, ""] | float,
) -> Float[Array, "networks weights"]:
    """Some weights change by normal noise, the same ones by the same in all networks.

    Args:
        keys: three.
        share: the largest; see `some`.
    """
    key_share, key_which, key_noise = keys
    which = some(key_share, key_which, weights.shape[1], share)
    noise = deviation * jax.random.normal(key_noise, which.shape)
    return jnp.where(which[None], weights + noise[None], weights)


def set_rules(
    keys: Sequence[Key[Array, ""]],
    weights: Float[Array, "networks weights"],
    share: Float[Array, ""] | float,
    deviation: Float[Array, ""] | float,
) -> Float[Array, "networks weights"]:
    """A few weights get normal values whatever they were, or all of them 0, in all networks the same.

    Args:
        keys: three.
        share: the largest; see `some`.
    """
    key_share, key_which, key_value = keys
    key_value, key_away = jax.random.split(key_value)
    which = some(key_share, key_which, weights.shape[1], share)
    value = deviation * jax.random.normal(key_value, which.shape)
    value = jnp.where(jax.random.bernoulli(key_away, TAKEN_AWAY), 0.0, value)
    return jnp.where(which[None], value[None], weights)


def some(
    key_share: Key[Array, ""], key_which: Key[Array, ""], count: int, share: Float[Array, ""] | float
) -> Bool[Array, " count"]:
    """Which of so many: a share, uniform in its logarithm from a single one up to `share`. 0: none."""
    drawn = jnp.maximum(share * count, 1.0) ** jax.random.uniform(key_share) / count
    return jax.random.bernoulli(key_which, jnp.where(share > 0, drawn, 0.0), (count,))
