"""Discrete actions that a gradient can pass: the straight-through Gumbel-softmax (Jang et al. 2017)."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Key


def straight_through(
    key: Key[Array, ""], logits: Float[Array, "*any act"], temperature: float
) -> Float[Array, "*any act"]:
    """A 1 at the place of an action drawn with the chances softmax(logits), and 0 elsewhere.

    Backwards it is softmax((logits + Gumbel noise) / temperature), whose largest entry is the one drawn: the
    lower the temperature, the nearer that is to what goes forward, and the more its gradient varies.
    """
    disturbed = logits + jax.random.gumbel(key, logits.shape)
    soft = jax.nn.softmax(disturbed / temperature, axis=-1)
    hard = jax.nn.one_hot(jnp.argmax(disturbed, axis=-1), logits.shape[-1], dtype=logits.dtype)
    # In this order forward is one or zero to the bit.
    return hard + (soft - jax.lax.stop_gradient(soft))
