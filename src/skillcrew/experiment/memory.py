"""How much memory a run will need, said before anything is compiled."""

import math

import jax
import psutil

from skillcrew.algorithms.algorithm import Algorithm
from skillcrew.errors import UserError
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


def available() -> int:
    """Bytes that the device can still give."""
    device = jax.devices()[0]
    if device.platform == "cpu":
        return psutil.virtual_memory().available
    stats = device.memory_stats() or {}
    return stats.get("bytes_limit", 2**63) - stats.get("bytes_in_use", 0)


def check(needed: int) -> None:
    """Raises `UserError` if the machine has less than `needed` bytes."""
    has = available()
    if needed > has:
        raise UserError(
            f"this run needs about {in_gib(needed)} and the machine has {in_gib(has)} free; "
            "lower --algorithm.buffer-capacity, --algorithm.population or the number of --seeds"
        )


def in_gib(size: int) -> str:
    """A size as people read it."""
    return f"{size / 2**30:.1f} GiB"
