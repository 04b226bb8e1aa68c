"""How much memory a run will need, said before anything is compiled."""

import math

import jax

from skillcrew.algorithms.algorithm import Algorithm
from skillcrew.experiment.config import RunConfig
from skillcrew.experiment.generation import flat_arrays, shapes

BASE = 600 * 2**20
"""What Python, JAX and a compilation take in any case, measured; on a GPU they take it elsewhere."""


def estimate(algorithm: Algorithm, config: RunConfig) -> int:
    """Bytes that a run holds at its peak: all seeds' state, what a generation makes, and JAX itself."""
    state = sum(
        math.prod(leaf.shape) * leaf.dtype.itemsize
        for leaf in jax.tree.leaves(jax.eval_shape(flat_arrays, shapes(algorithm, config)))
    )
    return BASE + state + len(config.seeds) * algorithm.transient_bytes()
