"""Where everything is in the warehouse, and how it is drawn."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, Key

from skillcrew.envs.warehouse.config import MARGIN, WarehouseConfig

BAND_SHARE = 0.6
"""Each shelf and station lies in the central share of a band of its own."""
GAP_SHARE = 0.5
"""The corridor lies in this central share of the width."""


class WarehouseState(eqx.Module):
    """Where everything is. A batch of worlds has its axis last in every field.

    The origin is the middle of the building; shelves are at the low end of the first axis.
    """

    position: Float[Array, "agents 2 *worlds"]
    """Metres."""
    gap: Float[Array, "*worlds"]
    """Where the corridor's middle is along the second axis."""
    shelf: Float[Array, "shelves 2 *worlds"]
    station: Float[Array, "stations 2 *worlds"]
    load: Float[Array, "orders 2 *worlds"]
    """Where each order's load is; on its shelf until it is lifted."""
    from_shelf: Int[Array, "orders *worlds"]
    to_station: Int[Array, "orders *worlds"]
    comes_at: Int[Array, "orders *worlds"]
    """The step at which each order comes, from 0."""
    held: Bool[Array, "orders agents *worlds"]
    """Who holds which load."""
    delivered: Bool[Array, "orders *worlds"]
    time: Int[Array, "*worlds"]
    """Steps since the reset."""


def draw_state(config: WarehouseConfig, key: Key[Array, ""]) -> WarehouseState:
    """A world at the start of an episode."""
    agents, orders = config.n_agents, config.n_orders
    shelves, stations = config.n_shelves, config.n_stations
    sizes = [1, 2 * agents, shelves, stations, orders, orders, orders]
    # One draw for everything: each random operation of its own takes XLA long to compile.
    draw, parts = jax.random.uniform(key, (sum(sizes),)), []
    for size in sizes:
        parts.append(draw[:size])
        draw = draw[size:]
    gap, start, shelf_draw, station_draw, *of_orders = parts
    shelf = _along(config, shelf_draw, -1)
    from_shelf, to_station, comes_at = (
        jnp.floor(one * count).astype(jnp.int32)
        for one, count in zip(of_orders, (shelves, stations, config.latest_order + 1), strict=True)
    )
    return WarehouseState(
        position=_starts(config, start.reshape(agents, 2)),
        gap=config.width * GAP_SHARE * (gap[0] - 0.5),
        shelf=shelf,
        station=_along(config, station_draw, 1),
        load=shelf[from_shelf],
        from_shelf=from_shelf,
        to_station=to_station,
        comes_at=comes_at,
        held=jnp.zeros((orders, agents), bool),
        delivered=jnp.zeros(orders, bool),
        time=jnp.zeros((), jnp.int32),
    )


def _along(config: WarehouseConfig, draw: Float[Array, " n"], side: int) -> Float[Array, "n 2"]:
    """Places along one end of the building, each in its band."""
    count = len(draw)
    within = jnp.arange(count, dtype=jnp.float32) + 0.5 + BAND_SHARE * (draw - 0.5)
    y = config.width * (within / count - 0.5)
    return jnp.stack([jnp.full(count, side * (config.length / 2 - MARGIN)), y], axis=1)


def _starts(config: WarehouseConfig, draw: Float[Array, "agents 2"]) -> Float[Array, "agents 2"]:
    """Anywhere but in the wall and the corridor."""
    beside = config.length / 2 - config.corridor_length / 2
    along = 2 * draw[:, 0] - 1
    x = along * beside + jnp.where(along < 0, -1.0, 1.0) * config.corridor_length / 2
    return jnp.stack([x, config.width * (draw[:, 1] - 0.5)], axis=1)
