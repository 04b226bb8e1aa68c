"""Warehouses of unequal sizes, and random worlds in which much happens."""

import functools
from typing import Any

import jax
import numpy as np

from oracles.carrying import far
from oracles.comparing import stacked
from skillcrew.envs.warehouse.config import MARGIN, WarehouseConfig
from skillcrew.envs.warehouse.state import WarehouseState
from skillcrew.envs.warehouse.world import WarehouseDomain

CASES: dict[str, dict[str, Any]] = {
    "one order": dict(n_agents=2, n_orders=1, n_shelves=3, n_stations=4, width=9.0),
    "in threes": dict(
        n_agents=5, n_orders=3, coupling=3, n_shelves=2, n_stations=1, reach=2.0, carry_speed=1.0,
        corridor_length=1.5, corridor_width=3.0, length=10.0, episode_length=12, latest_order=11,
    ),
    "alone": dict(
        n_agents=3, n_orders=4, coupling=1, n_shelves=1, n_stations=2, latest_order=0, station_radius=1.0,
        max_speed=1.5, length=9.0, width=6.0,
    ),
}  # fmt: skip
WORLDS = 60


@functools.cache
def environment(case: str) -> WarehouseDomain:
    return WarehouseDomain(WarehouseConfig(**CASES[case]))


@functools.cache
def compiled_step(case: str):
    return jax.jit(environment(case).step_worlds)


def random_states(config: WarehouseConfig, rng: np.random.Generator, worlds: int = WORLDS) -> WarehouseState:
    """Agents in and around the corridor, at shelves and under loads, of which many are nearly delivered."""
    one_each = [_random_state(config, rng) for _ in range(worlds)]
    return stacked(WarehouseState, one_each)


def _random_state(config: WarehouseConfig, rng: np.random.Generator) -> dict[str, Any]:
    agents, orders = config.n_agents, config.n_orders
    half, end = config.corridor_length / 2, config.length / 2 - MARGIN
    gap = rng.uniform(-0.25, 0.25) * config.width
    shelf, station = (
        np.stack([np.full(count, x), np.sort(rng.uniform(-0.5, 0.5, count)) * config.width], axis=1)
        for count, x in ((config.n_shelves, -end), (config.n_stations, end))
    )
    from_shelf, to_station = rng.integers(len(shelf), size=orders), rng.integers(len(station), size=orders)
    time = config.episode_length - 1 if rng.random() < 0.3 else rng.integers(config.episode_length)
    delivered = rng.random(orders) < rng.choice([0.0, 0.3, 0.8])
    if rng.random() < 0.5:
        delivered = np.arange(orders) != rng.integers(orders)
    load, position = shelf[from_shelf].copy(), np.zeros((agents, 2))
    under_way = ~delivered & (rng.random(orders) < 0.5)
    for order in np.flatnonzero(under_way):
        corridor, near_station = rng.random() < 0.4, rng.random() < 0.6
        place = np.array([rng.uniform(-1.5, 1.5) * half, gap])
        if (delivered.sum() == orders - 1 and rng.random() < 0.5) or (not corridor and near_station):
            place = station[to_station[order]] - [config.station_radius + rng.uniform(-0.2, 0.5), 0.1]
        load[order] = place
    for agent in range(agents):
        position[agent] = _somewhere(config, rng, gap, load)
    held = np.zeros((orders, agents), bool)
    for order in np.flatnonzero(under_way):
        hands = rng.permutation(np.flatnonzero(~held.any(0)))[: config.coupling + (rng.random() < 0.3)]
        for agent in hands:
            place = load[order] + rng.uniform(-0.7, 0.7, 2) * config.reach
            position[agent] = _possible(config, rng, gap, place)
            held[order, agent] = far(position[agent], load[order]) < config.reach
        held[order] &= held[order].sum() >= config.coupling
    lying = ~delivered & ~held.any(1)
    load[lying] = shelf[from_shelf[lying]]
    for order in np.flatnonzero(lying & (rng.random(orders) < 0.4)):
        for agent in rng.permutation(np.flatnonzero(~held.any(0)))[: config.coupling]:
            place = load[order] + rng.uniform(-0.9, 0.9, 2) * config.reach
            position[agent] = _possible(config, rng, gap, place)
    comes_at = np.where(held.any(1) | delivered, 0, rng.integers(config.latest_order + 1, size=orders))
    return dict(
        position=position, gap=np.array(gap), shelf=shelf, station=station, load=load,
        from_shelf=from_shelf, to_station=to_station, comes_at=comes_at, held=held, delivered=delivered,
        time=np.array(time),
    )  # fmt: skip


def _somewhere(config: WarehouseConfig, rng: np.random.Generator, gap: float, load: np.ndarray) -> np.ndarray:
    """A place where an agent can be: often by a load, at the wall, in the corridor, or at its mouths."""
    half, room = config.corridor_length / 2, config.corridor_width / 2
    kind = rng.random()
    place = rng.uniform(-0.5, 0.5, 2) * [config.length, config.width]
    if kind < 0.15:
        place[0] = rng.choice([-1, 1]) * (half + rng.uniform(0, 0.5))
    elif kind < 0.6:
        place = load[rng.integers(len(load))] + rng.uniform(-0.8, 0.8, 2) * config.reach
    elif kind < 0.8:
        place = np.array(
            [rng.choice([-1, 1]) * rng.uniform(0.3, 1.8) * half, gap + rng.uniform(-1, 1) * room]
        )
    return _possible(config, rng, gap, place)


def _possible(config: WarehouseConfig, rng: np.random.Generator, gap: float, place: np.ndarray) -> np.ndarray:
    """The same place, or one beside the wall."""
    half, room = config.corridor_length / 2, config.corridor_width / 2
    place = np.clip(place, [-config.length / 2, -config.width / 2], [config.length / 2, config.width / 2])
    if abs(place[0]) < half and abs(place[1] - gap) > room:
        place[0] = rng.choice([-1.001, 1.001]) * half
    return place
