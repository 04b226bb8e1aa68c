"""Which places have been searched, and which one each agent should search next."""

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from skillcrew.envs.plane import Offset, nearest
from skillcrew.envs.rescue.config import RescueConfig

Position = Float[Array, "agents 2 *worlds"]
Searched = Bool[Array, "cells *worlds"]

ROUNDING = 1e-5
"""XLA may compute a distance twice and round it in two ways: nobody would be as near as the nearest."""


def centre_of(config: RescueConfig, cell: Int[Array, "*any"]) -> tuple[Array, Array]:
    """The middle of cells, along x and along y. Cells are numbered along y first."""
    row, column = (part.astype(jnp.float32) for part in jnp.divmod(cell, config.cells))
    return (row + 0.5) * config.cell_size, (column + 0.5) * config.cell_size


def to_cell(config: RescueConfig, position: Position, cell: Int[Array, "agents *worlds"]) -> Offset:
    """From each agent to the middle of a cell of its own."""
    x, y = centre_of(config, cell)
    return Offset(x - position[:, 0], y - position[:, 1])


def searched_from(config: RescueConfig, position: Position, searched: Searched) -> Searched:
    """What has been searched with agents where they are now. Once all is, the search begins anew."""
    searched = searched | (_of_nearest_agent(config, position) <= config.searched_radius**2)
    return searched & ~searched.all(0)[None]


def next_cells(config: RescueConfig, position: Position, searched: Searched) -> Int[Array, "agents *worlds"]:
    """Which cell is next for each agent.

    It is the nearest that nobody has searched and no other agent is nearer to. Where there is none, because
    others are nearer to all, it is the nearest that nobody has searched.
    """
    of_nearest_agent = _of_nearest_agent(config, position) * (1 + ROUNDING) + ROUNDING
    # Farther than any distance in the square: what others are nearer to comes after all that is one's own.
    behind = 4 * config.world_size**2
    cells = [
        Offset(x - position[:, 0], y - position[:, 1])
        for x, y in (_centre(config, cell) for cell in range(config.cells**2))
    ]
    return nearest(
        (
            one,
            jnp.broadcast_to(~known[None], one.dx.shape),
            jnp.where(one.squared <= least[None], one.squared, one.squared + behind),
        )
        for one, least, known in zip(cells, of_nearest_agent, searched, strict=True)
    ).index


def _of_nearest_agent(config: RescueConfig, position: Position) -> Float[Array, "cells *worlds"]:
    """The square of the distance from each cell to the nearest agent."""
    # One reduction over an axis of cells, and not one each: XLA compiles dozens of them slowly.
    cells = jnp.arange(config.cells**2).reshape(-1, *(1,) * (position.ndim - 1))
    x, y = centre_of(config, cells)
    return Offset(x - position[None, :, 0], y - position[None, :, 1]).squared.min(1)


def _centre(config: RescueConfig, cell: int) -> tuple[float, float]:
    row, column = divmod(cell, config.cells)
    return (row + 0.5) * config.cell_size, (column + 0.5) * config.cell_size
