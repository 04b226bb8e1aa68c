"""The rewards of the skills and of the team, and when the team's task is done."""

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from skillcrew.envs.rover.config import RoverConfig
from skillcrew.envs.rover.coupling import types_observed
from skillcrew.envs.rover.state import Progress


def closeness(squared_distance: Float[Array, "*any"], activation_distance: float) -> Float[Array, "*any"]:
    """min(1, activation distance / distance), in (0, 1]: the local reward of "go to"."""
    # The bound under the root gives both the minimum with 1 and a finite value at distance 0.
    return activation_distance / jnp.sqrt(jnp.maximum(squared_distance, activation_distance**2))


def team_reward(config: RoverConfig, before: Progress, after: Progress) -> Float[Array, "*worlds"]:
    """The team's reward of one step, for what it has to show more than before; over an episode in [0, 1]."""
    if config.team_reward == "closest":
        assert before.closest is not None and after.closest is not None
        return _share_of_value(config, after.closest - before.closest)
    if config.team_reward == "value":
        return _share_of_value(config, (after.observed & ~before.observed).astype(jnp.float32))
    done = [types_observed(progress.observed, config.pois_per_type) for progress in (before, after)]
    if config.team_reward == "fraction":
        gained: Int[Array, "*worlds"] = (done[1] & ~done[0]).sum(0)
        return gained.astype(jnp.float32) / config.n_poi_types
    return (done[1].all(0) & ~done[0].all(0)).astype(jnp.float32)


def task_done(config: RoverConfig, progress: Progress) -> Bool[Array, "*worlds"]:
    """Whether nothing is left to do: every type is observed, or every POI where each of them is paid.

    Where the closest visit counts, there may always be a closer one.
    """
    if config.team_reward == "closest":
        return jnp.zeros(progress.observed.shape[1:], bool)
    if config.team_reward == "value":
        return progress.observed.all(0)
    return types_observed(progress.observed, config.pois_per_type).all(0)


def _share_of_value(config: RoverConfig, gained: Float[Array, "pois *worlds"]) -> Float[Array, "*worlds"]:
    """Of the value of all POIs, what is gained if of each POI this share is."""
    total = sum(config.values) * config.pois_per_type
    shares = [value / total for value in config.values for _ in range(config.pois_per_type)]
    return sum((share * gained[poi] for poi, share in enumerate(shares)), start=jnp.zeros_like(gained[0]))
