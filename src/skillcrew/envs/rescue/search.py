"""Which places have been searched, and which one each agent should search next."""

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from skillcrew.envs.plane import Nearest, Offset, nearest
from skillcrew.envs.rescue.config import RescueConfig


def cell_centres(config: RescueConfig) -> list[tuple[float, float]]:
    """Row by row, the first axis slowest."""
    places = [(index + 0.5) * config.cell_size for index in range(config.cells)]
    return [(x, y) for x in places for y in places]


def search(
    config: RescueConfig,
    position: Float[Array, "agents 2 *worlds"],
    searched: Bool[Array, "cells *worlds"],
) -> tuple[Bool[Array, "cells *worlds"], Nearest]:
    """What has been searched with agents where they are now, and the cell that is next for each.

    Next is the nearest cell that nobody has searched and no other agent is nearer to. Where there is none,
    because others are nearer to all, it is the nearest that nobody has searched. Once all is searched, the
    search begins anew.
    """
    offsets = [Offset(x - position[:, 0], y - position[:, 1]) for x, y in cell_centres(config)]
    of_nearest_agent = [one.squared.min(0) for one in offsets]
    within = jnp.stack([squared <= config.searched_radius**2 for squared in of_nearest_agent])
    searched = searched | within
    searched &= ~searched.all(0)[None]
    # Farther than any distance in the square: what others are nearer to comes after all that is one's own.
    behind = 4 * config.world_size**2
    targets = (
        (
            one,
            jnp.broadcast_to(~known[None], one.dx.shape),
            jnp.where(one.squared <= least[None], one.squared, one.squared + behind),
        )
        for one, least, known in zip(offsets, of_nearest_agent, searched, strict=True)
    )
    return searched, nearest(targets)
