"""Where everything is in search and rescue, and how it is drawn."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, Key

from skillcrew.envs.rescue.config import BASE_SHARE, RescueConfig

SMALL = 1e-6
"""Metres: keeps the direction to a victim that is drawn right at the base finite."""


class RescueState(eqx.Module):
    """Where everything is. A batch of worlds has its axis last in every field."""

    position: Float[Array, "agents 2 *worlds"]
    """Metres; the square spans 0 to `world_size` on both axes."""
    base: Float[Array, "2 *worlds"]
    victim: Float[Array, "victims 2 *worlds"]
    """Metres."""
    held: Bool[Array, "victims agents *worlds"]
    """Who holds whom."""
    saved: Bool[Array, "victims *worlds"]
    searched: Bool[Array, "cells *worlds"]
    """Row by row, the first axis slowest."""
    next_cell: Int[Array, "agents *worlds"]
    """Which cell each agent is to search next."""
    time: Int[Array, "*worlds"]
    """Steps since the reset."""


def draw_state(config: RescueConfig, key: Key[Array, ""]) -> RescueState:
    """A world at the start of an episode, in which nobody has begun to search."""
    agents, victims, size = config.n_agents, config.n_victims, config.world_size
    # One draw for everything: each random operation of its own takes XLA long to compile.
    draw = jax.random.uniform(key, (2 * (1 + agents + victims),)).reshape(-1, 2)
    base = size * ((1 - BASE_SHARE) / 2 + BASE_SHARE * draw[0])
    away = size * draw[1 + agents :] - base[None]
    distance = jnp.sqrt((away**2).sum(1, keepdims=True))
    least = config.victim_distance
    outside = jnp.where(distance < least, away * (least / jnp.maximum(distance, SMALL)), away)
    return RescueState(
        position=base[None] + config.base_radius * (2 * draw[1 : 1 + agents] - 1),
        base=base,
        victim=base[None] + outside,
        held=jnp.zeros((victims, agents), bool),
        saved=jnp.zeros(victims, bool),
        searched=jnp.zeros(config.cells**2, bool),
        next_cell=jnp.zeros(agents, jnp.int32),
        time=jnp.zeros((), jnp.int32),
    )
