"""Smallest tasks whose values are known, as sources of transitions (one learner each).

Observations have one number, which the second entry (always 0) makes two; actions have one.
"""

import jax
import jax.numpy as jnp

from skillcrew.learners.batch import Batch

DISCOUNT = 0.5
OBSERVATION, ACTION = 2, 1
PROBES = ("constant", "by observation", "two steps", "cut off", "by action", "by both")
OPTIMUM = 0.4
"""The best action of "by action"."""


def batches(key, delay: int, size: int) -> Batch:
    """Transitions of random actions: leaves [probes, delay, size, …]."""
    key_place, key_action = jax.random.split(key)
    place = jax.random.bernoulli(key_place, 0.5, (delay, size)).astype(jnp.float32)
    action = jax.random.uniform(key_action, (delay, size), minval=-1.0, maxval=1.0)
    side = 2 * place - 1
    one, zero = jnp.ones_like(place), jnp.zeros_like(place)
    #       where, reward, where next, terminated
    rows = {
        "constant": (zero, one, zero, one),
        "by observation": (side, side, side, one),
        # From 0 to 1 for nothing, then 1 for the end.
        "two steps": (place, place, one, place),
        # 1 at each step, for ever: every episode is cut off by time, which is no end of the task.
        "cut off": (zero, one, zero, zero),
        "by action": (zero, -((action - OPTIMUM) ** 2), zero, one),
        "by both": (side, -((action - 0.5 * side) ** 2), side, one),
    }
    stacked = [jnp.stack([rows[name][column] for name in PROBES]) for column in range(4)]
    where, reward, following, terminated = stacked
    actions = jnp.stack([action[..., None]] * len(PROBES))
    return Batch(_observed(where), actions, reward, _observed(following), terminated)


def _observed(where):
    return jnp.stack([where, jnp.zeros_like(where)], axis=-1)
