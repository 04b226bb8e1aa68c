"""The scale of returns, so that critics learn numbers of about 1 whatever rewards are."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

REMEMBERED = 0.99
"""Share of what was known that a generation leaves."""

LEAST_VARIANCE = 1e-2
"""Of returns; those that hardly differ are not blown up (Yu et al. 2022)."""


class ValueScale(eqx.Module):
    """Running mean and variance of returns (value normalisation; Yu et al. 2022, after van Hasselt 2016)."""

    mean: Float[Array, ""]
    square: Float[Array, ""]
    weight: Float[Array, ""]
    """How much was taken in, up to 1: what is not yet is made up for."""

    @classmethod
    def create(cls) -> "ValueScale":
        """Nothing is known: values stay as they are."""
        return cls(jnp.zeros(()), jnp.zeros(()), jnp.zeros(()))

    def observe(
        self, returns: Float[Array, "time worlds agents"], mask: Bool[Array, "time worlds"]
    ) -> "ValueScale":
        """Takes in the returns of the steps that count."""
        counts = jnp.broadcast_to(mask[..., None], returns.shape)
        number = jnp.maximum(counts.sum(dtype=returns.dtype), 1.0)
        mean = jnp.where(counts, returns, 0.0).sum() / number
        square = jnp.where(counts, returns**2, 0.0).sum() / number

        def after(old: Array, new: Array) -> Array:
            return REMEMBERED * old + (1 - REMEMBERED) * new

        return ValueScale(
            after(self.mean, mean), after(self.square, square), after(self.weight, jnp.ones(()))
        )

    def normalised(self, returns: Float[Array, "*any"]) -> Float[Array, "*any"]:
        """Returns as a critic learns them."""
        mean, deviation = self._moments()
        return (returns - mean) / deviation

    def returns(self, normalised: Float[Array, "*any"]) -> Float[Array, "*any"]:
        """What a critic says, as returns."""
        mean, deviation = self._moments()
        return normalised * deviation + mean

    def _moments(self) -> tuple[Array, Array]:
        known = self.weight > 0
        weight = jnp.where(known, self.weight, 1.0)
        mean = self.mean / weight
        variance = jnp.maximum(self.square / weight - mean**2, LEAST_VARIANCE)
        return mean, jnp.where(known, jnp.sqrt(variance), 1.0)
