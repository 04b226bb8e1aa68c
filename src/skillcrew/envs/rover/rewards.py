"""The rewards of the skills and of the team."""

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int


def closeness(squared_distance: Float[Array, "*any"], activation_distance: float) -> Float[Array, "*any"]:
    """min(1, activation distance / distance), in (0, 1]: the local reward of "go to"."""
    # The bound under the root gives both the minimum with 1 and a finite value at distance 0.
    return activation_distance / jnp.sqrt(jnp.maximum(squared_distance, activation_distance**2))


def team_reward(
    before: Bool[Array, "types *worlds"], after: Bool[Array, "types *worlds"], kind: str
) -> Array:
    """The team's reward of one step, `kind` "binary" or "fraction"; over an episode in [0, 1]."""
    if kind == "fraction":
        gained: Int[Array, "*worlds"] = (after & ~before).sum(0)
        return gained.astype(jnp.float32) / len(after)
    return (after.all(0) & ~before.all(0)).astype(jnp.float32)
