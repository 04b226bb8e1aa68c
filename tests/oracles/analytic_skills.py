"""Skills that need no training: networks written by hand, which go to the one POI of a type."""

import math

import jax
import jax.numpy as jnp
import numpy as np

from skillcrew.envs.padded import uniform
from skillcrew.envs.rover.crew import RoverType
from skillcrew.envs.rover.world import RoverDomain
from skillcrew.policies.actor import Actor
from skillcrew.policies.network import MLP

SURE = 100.0
"""Makes the weakest reading of interest, of a POI 100 m away, a full one."""


def turn_to(sector: int, sectors: int) -> float:
    """In radians: to the middle of the sector; half as far if it is ahead, so as not to zigzag."""
    middle = math.remainder((sector + 0.5) * 2 * math.pi / sectors, 2 * math.pi)
    return middle / 2 if abs(middle) < math.pi / 2 else middle


def go_to_skill(env: RoverDomain, rover: RoverType, kind: int) -> Actor:
    """Turns a rover towards the one sector in which the type is sensed, and drives.

    Two rectified units per sector tell whether anything is sensed in it: min(1, much of the reading).
    """
    hidden = 2 * max(other.sectors for other in env.config.crew)
    weights, biases = np.zeros((uniform(env).observation_size, hidden)), np.zeros(hidden)
    turns = np.zeros((hidden, 2))
    rovers = len(env.config.crew)
    for sector in range(rover.sectors):
        turn = np.clip(turn_to(sector, rover.sectors) / rover.max_turn, -0.99, 0.99)
        reading = sector * (rovers + env.config.n_poi_types) + rovers + kind
        weights[reading, 2 * sector : 2 * sector + 2] = SURE
        biases[2 * sector + 1] = -1.0
        turns[2 * sector : 2 * sector + 2, 0] = np.arctanh(turn), -np.arctanh(turn)
    drive = np.array([0.0, 5.0])
    layers = [(weights, turns), (biases, drive)]
    arrays = [tuple(jnp.asarray(part, jnp.float32) for part in parts) for parts in layers]
    return Actor(MLP(*arrays), "sqrt")


def go_to_skills(env: RoverDomain) -> tuple[Actor, tuple[str, ...]]:
    """One for each type of rovers and of POIs, stacked, and their names."""
    skills, names = [], []
    for rover in env.config.crew:
        for kind, letter in enumerate(env.config.type_names):
            skills.append(go_to_skill(env, rover, kind))
            names.append(f"{rover.name}/go_to_poi_{letter}" if env.types else f"go_to_poi_{letter}")
    return jax.tree.map(lambda *leaves: jnp.stack(leaves), *skills), tuple(names)
