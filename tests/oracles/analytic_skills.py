"""Skills that need no training: networks written by hand, which go to the one POI of a type."""

import jax
import jax.numpy as jnp
import numpy as np

from skillcrew.envs.rover.world import RoverDomain
from skillcrew.policies.actor import Actor
from skillcrew.policies.network import MLP

TURNS = (0.125, 0.75, -0.75, -0.125)
"""By the sector that the POI is in, as shares of a half turn: little if it is ahead, else about."""
SURE = 100.0
"""Makes the weakest reading of interest, of a POI 100 m away, a full one."""


def go_to_skill(env: RoverDomain, kind: int) -> Actor:
    """Turns towards the one sector in which the type is sensed, and drives; needs four sectors.

    Two rectified units per sector tell whether anything is sensed in it: min(1, much of the reading).
    """
    weights, biases = np.zeros((env.observation_size, 8)), np.zeros(8)
    turns = np.zeros((8, 2))
    for sector, turn in enumerate(TURNS):
        reading = sector * (1 + env.config.n_poi_types) + 1 + kind
        weights[reading, 2 * sector : 2 * sector + 2] = SURE
        biases[2 * sector + 1] = -1.0
        turns[2 * sector : 2 * sector + 2, 0] = np.arctanh(turn), -np.arctanh(turn)
    drive = np.array([0.0, 5.0])
    layers = [(weights, turns), (biases, drive)]
    arrays = [tuple(jnp.asarray(part, jnp.float32) for part in parts) for parts in layers]
    return Actor(MLP(*arrays), "sqrt")


def go_to_skills(env: RoverDomain) -> tuple[Actor, tuple[str, ...]]:
    """One for each type, stacked, and their names."""
    skills = [go_to_skill(env, kind) for kind in range(env.config.n_poi_types)]
    names = tuple(f"go_to_poi_{name}" for name in env.config.type_names)
    return jax.tree.map(lambda *leaves: jnp.stack(leaves), *skills), names
