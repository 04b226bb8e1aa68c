"""Search and rescue in unequal sizes, and random worlds in which much happens."""

import functools
from typing import Any

import jax
import numpy as np

from oracles.carrying import far
from oracles.comparing import stacked
from skillcrew.envs.rescue.config import RescueConfig
from skillcrew.envs.rescue.state import RescueState
from skillcrew.envs.rescue.world import RescueDomain

CASES: dict[str, dict[str, Any]] = {
    "two victims": dict(n_agents=3, n_victims=2, cells=5, world_size=14.0, victim_distance=4.0),
    "many victims": dict(
        n_agents=5, n_victims=4, coupling=1, cells=4, world_size=10.0, victim_distance=3.0, episode_length=9,
        carry_speed=1.0,
    ),
    "three to lift": dict(
        n_agents=6, n_victims=1, coupling=3, cells=3, world_size=9.0, sensor_radius=4.0, reach=2.0,
        base_radius=1.5, victim_distance=3.0, max_speed=1.5,
    ),
}  # fmt: skip
WORLDS = 60


@functools.cache
def environment(case: str) -> RescueDomain:
    return RescueDomain(RescueConfig(**CASES[case]))


@functools.cache
def compiled_step(case: str):
    return jax.jit(environment(case).step_worlds)


def random_states(config: RescueConfig, rng: np.random.Generator, worlds: int = WORLDS) -> RescueState:
    """Most agents near a victim, many victims carried and near the base, the search often nearly over."""
    one_each = [_random_state(config, rng) for _ in range(worlds)]
    return stacked(RescueState, one_each)


def _random_state(config: RescueConfig, rng: np.random.Generator) -> dict[str, Any]:
    size, agents, victims = config.world_size, config.n_agents, config.n_victims
    base = rng.uniform(0.35, 0.65, 2) * size
    victim = rng.uniform(0, size, (victims, 2))
    saved = rng.random(victims) < rng.choice([0.0, 0.3, 0.8])
    if rng.random() < 0.4:
        saved = np.arange(victims) != rng.integers(victims)
    for one in range(victims):
        if saved[one] or rng.random() < 0.5:
            angle, away = (
                rng.uniform(0, 2 * np.pi),
                rng.uniform(0.2, 0.9) if saved[one] else 1 + rng.random() / 3,
            )
            victim[one] = base + config.base_radius * away * np.array([np.cos(angle), np.sin(angle)])
        elif far(victim[one], base) < config.base_radius:
            victim[one] = 0.0
    position = rng.uniform(0, size, (agents, 2))
    held = np.zeros((victims, agents), bool)
    for agent in range(agents):
        one = rng.choice(np.flatnonzero(~saved)) if not saved.all() else 0
        if rng.random() < 0.7:
            place = victim[one] + rng.uniform(-1.1, 1.1, 2) * config.reach * rng.uniform(0.3, 1)
            position[agent] = np.clip(place, 0, size)
        near = far(position[agent], victim[one]) < config.reach
        held[one, agent] = near and not saved[one] and rng.random() < 0.8
    held &= (held.sum(1) >= config.coupling)[:, None]
    searched = rng.random(config.cells**2) < rng.choice([0.3, 0.9, 1.0])
    # Where but one is searched, it is where an agent is, and often close to its middle.
    side = size / config.cells
    last = np.minimum(position[0] // side, config.cells - 1)
    if searched.all() and rng.random() < 0.5:
        position[0] = (last + 0.5) * side
        held[:, 0] = False
        held &= (held.sum(1) >= config.coupling)[:, None]
    searched[int(last @ [config.cells, 1])] = False
    time = config.episode_length - 1 if rng.random() < 0.3 else rng.integers(config.episode_length)
    return dict(
        position=position, base=base, victim=victim, held=held, saved=saved, searched=searched,
        next_cell=rng.integers(0, config.cells**2, agents), time=np.array(time),
    )  # fmt: skip
