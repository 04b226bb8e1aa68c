"""What there is to draw of the warehouse."""

import jax.numpy as jnp
from jaxtyping import Array, Bool

from skillcrew.envs.scene import Discs, Labels, Lines, Points, Scene
from skillcrew.envs.warehouse.config import WarehouseConfig
from skillcrew.envs.warehouse.state import WarehouseState


def scene(config: WarehouseConfig, state: WarehouseState, come: Bool[Array, " orders"]) -> Scene:
    """One moment of one world."""
    carried = state.held.any(1)
    of_load = jnp.where(state.delivered, 2, jnp.where(carried, 1, jnp.where(come, 0, -1)))
    pairs = (config.n_orders, config.n_agents, 2)
    start, end = _wall(config, state)
    return Scene(
        low=(-config.length / 2, -config.width / 2),
        high=(config.length / 2, config.width / 2),
        points=(
            Points("agents", state.position),
            Points("loads", state.load, state=of_load, states=("waiting", "carried", "delivered")),
        ),
        discs=(
            Discs("shelves", state.shelf, jnp.full(config.n_shelves, config.reach)),
            Discs("stations", state.station, jnp.full(config.n_stations, config.station_radius)),
        ),
        lines=(
            Lines("wall", start, end),
            Lines(
                "holds",
                jnp.broadcast_to(state.position[None], pairs).reshape(-1, 2),
                jnp.broadcast_to(state.load[:, None], pairs).reshape(-1, 2),
                state=jnp.where(state.held, 0, -1).ravel(),
                states=("holds",),
            ),
        ),
        labels=(
            Labels(
                jnp.concatenate([state.shelf, state.station]), (*config.shelf_names, *config.station_names)
            ),
        ),
    )


def _wall(config: WarehouseConfig, state: WarehouseState) -> tuple[Array, Array]:
    """Its outline: on each side of the corridor the two faces, and the corridor's own side."""
    half, edge = config.corridor_length / 2, config.width / 2
    start, end = [], []
    for side in (-1, 1):
        mouth = state.gap + side * config.corridor_width / 2
        corners = [(-half, side * edge), (-half, mouth), (half, mouth), (half, side * edge)]
        points = [jnp.stack([jnp.asarray(x), jnp.asarray(y, jnp.float32)]) for x, y in corners]
        start += points[:-1]
        end += points[1:]
    return jnp.stack(start), jnp.stack(end)
