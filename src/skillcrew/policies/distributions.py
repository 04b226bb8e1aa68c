"""What a policy draws its actions from: one of several choices, or numbers in [-1, 1]."""

import math

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, Key

LARGEST = 1 - 1e-6
"""Actions nearer to ±1 count as this one, or what they were before tanh would be infinite."""


class Categorical(eqx.Module):
    """One of several choices."""

    logits: Float[Array, "*batch choices"]
    """Logarithms of what is proportional to the probabilities."""

    def sample(self, key: Key[Array, ""]) -> Int[Array, "*batch"]:
        """A choice."""
        return jax.random.categorical(key, self.logits).astype(jnp.int32)

    def mode(self) -> Int[Array, "*batch"]:
        """The most probable choice; of several, the first."""
        return jnp.argmax(self.logits, axis=-1).astype(jnp.int32)

    def probabilities(self) -> Float[Array, "*batch choices"]:
        """Of all choices."""
        return jax.nn.softmax(self.logits)

    def log_probability(self, taken: Int[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Of the choice that was taken."""
        return jnp.take_along_axis(jax.nn.log_softmax(self.logits), taken[..., None], axis=-1)[..., 0]

    def entropy(self) -> Float[Array, "*batch"]:
        """In nats; a choice of probability 0 adds nothing."""
        logarithm = jax.nn.log_softmax(self.logits)
        probability = jnp.exp(logarithm)
        return -jnp.where(probability > 0, probability * logarithm, 0.0).sum(-1)


class SquashedNormal(eqx.Module):
    """Numbers that are normal before tanh brings them into [-1, 1]."""

    mean: Float[Array, "*batch act"]
    log_deviation: Float[Array, "*batch act"]

    def sample(self, key: Key[Array, ""]) -> Float[Array, "*batch act"]:
        """An action."""
        return jnp.tanh(self.mean + jnp.exp(self.log_deviation) * jax.random.normal(key, self.mean.shape))

    def mode(self) -> Float[Array, "*batch act"]:
        """The action in the middle."""
        return jnp.tanh(self.mean)

    def log_probability(self, taken: Float[Array, "*batch act"]) -> Float[Array, "*batch"]:
        """Logarithm of the density of an action."""
        bounded = jnp.clip(taken, -LARGEST, LARGEST)
        before = jnp.arctanh(bounded)
        distance = (before - self.mean) * jnp.exp(-self.log_deviation)
        density = -0.5 * (distance**2 + math.log(2 * math.pi)) - self.log_deviation
        return (density - jnp.log1p(-(bounded**2))).sum(-1)

    def entropy(self) -> Float[Array, "*batch"]:
        """In nats, of the normal distribution before tanh; that of the action has no closed form."""
        return (self.log_deviation + 0.5 * math.log(2 * math.pi * math.e)).sum(-1)


Distribution = Categorical | SquashedNormal


def with_floor(
    distribution: Categorical, share: Float[Array, ""], available: Array | None = None
) -> Categorical:
    """The same choices, a share of them drawn evenly among all (Foerster et al. 2018).

    Args:
        available: which choices there are; None for all.
    """
    probabilities = distribution.probabilities()
    counted = jnp.ones_like(probabilities) if available is None else available.astype(probabilities.dtype)
    even = jnp.broadcast_to(counted, probabilities.shape)
    even = even / even.sum(-1, keepdims=True)
    mixed = (1 - share) * probabilities + share * even
    return Categorical(jnp.log(jnp.maximum(mixed, jnp.finfo(mixed.dtype).tiny)))
