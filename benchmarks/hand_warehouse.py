"""The warehouse by hand: skills that act by what an agent sees, and a team that is told the state."""

import jax
import jax.numpy as jnp
from benchmarks.hand_rescue import assigned, towards
from jaxtyping import Array, Float, Int

from skillcrew.envs.warehouse.building import path_length
from skillcrew.envs.warehouse.config import WarehouseConfig
from skillcrew.envs.warehouse.state import WarehouseState
from skillcrew.envs.warehouse.world import WarehouseDomain


def actions(
    env: WarehouseDomain, observation: Float[Array, "agents obs worlds"]
) -> Float[Array, "skills agents 2 worlds"]:
    """The shortest way to each shelf and station; out of the corridor, and there on to stand aside."""
    config = env.config
    gap = observation[:, :2]
    ends = [-1] * config.n_shelves + [1] * config.n_stations
    places = [observation[:, 2 + 2 * place : 4 + 2 * place] for place in range(len(ends))]
    ways = [_way(config, gap, place, side) for place, side in zip(places, ends, strict=True)]
    return jnp.stack(
        [*(towards(way, config.max_speed) for way in ways), towards(-10 * gap, config.max_speed)]
    )


def _way(config: WarehouseConfig, gap: Array, place: Array, side: int) -> Array:
    """To the place itself, or to the mouth of the corridor that comes first."""
    half, x = config.corridor_length / 2, -gap[:, :1]
    mouth = jnp.array([side * half, 0.0])[None, :, None]
    # Into the corridor with some room to its sides, and once in it straight through.
    lined_up = jnp.abs(gap[:, 1:]) < config.corridor_width / 2 * 0.8
    through = jnp.where(lined_up | (side * x > -half), gap + 2 * mouth, gap - mouth)
    return jnp.where(side * x >= half, place, through)


def told(env: WarehouseDomain, state: WarehouseState) -> Int[Array, "agents worlds"]:
    """Bearers to their stations; as many as it takes to each load that waits; others to the middle shelf."""
    return jax.vmap(lambda one: _told(env, one), in_axes=-1, out_axes=-1)(state)


def _told(env: WarehouseDomain, state: WarehouseState) -> Int[Array, " agents"]:
    config = env.config
    to_shelf = jnp.stack([path_length(config, state, place, -1) for place in state.shelf])
    distance = to_shelf[state.from_shelf]
    lying = ~state.delivered & ~state.held.any(1)
    come = state.comes_at <= state.time
    free = ~state.held.any(0)
    target = assigned(distance, lying & come, free, config.coupling)
    to_load = jnp.where(target < 0, config.n_shelves // 2, state.from_shelf[target])
    to_station = config.n_shelves + jnp.where(state.held, state.to_station[:, None], 0).sum(0)
    return jnp.where(free, to_load, to_station).astype(jnp.int32)
