"""Agents and things in the plane: how agents drive, what is nearest to each, and what closeness is paid.

Every array has its world axes last, and the few things in front are unrolled, so that the arithmetic runs
along the longest axis.
"""

import functools
from collections.abc import Iterable
from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

PerAgent = Float[Array, "agents *worlds"]


class Offset(NamedTuple):
    """From every agent to one place, or to a place of its own, along x and along y."""

    dx: Array
    dy: Array

    @property
    def squared(self) -> Array:
        """The distance's square."""
        return self.dx * self.dx + self.dy * self.dy


class Nearest(NamedTuple):
    """Of several places the nearest to each agent; offset 0 where there is none."""

    there: Bool[Array, "agents *worlds"]
    """Whether there is any."""
    offset: Offset
    rank: PerAgent
    """The distance's square, or what else was compared; infinite where there is none."""
    index: Int[Array, "agents *worlds"]
    """Which of the places it is; -1 where there is none."""


def offset(position: Float[Array, "agents 2 *worlds"], place: Float[Array, "2 *worlds"]) -> Offset:
    """From every agent to one place."""
    return Offset(place[None, 0] - position[:, 0], place[None, 1] - position[:, 1])


def driven(
    action: Float[Array, "agents 2 *worlds"], speed: Float[Array, "agents *worlds"]
) -> Float[Array, "agents 2 *worlds"]:
    """How far actions drive: along their direction, an action of length 1 or more at full speed."""
    action = jnp.clip(action, -1.0, 1.0)
    squared = action[:, 0] * action[:, 0] + action[:, 1] * action[:, 1]
    scale = speed / jnp.sqrt(jnp.maximum(squared, 1.0))
    return action * scale[:, None]


def nearest(places: Iterable[tuple[Offset, Bool[Array, "agents *worlds"], Array | None]]) -> Nearest:
    """The nearest of those that count.

    Args:
        places: for each, its offset, for whom it counts, and what is compared instead of the square of its
            distance, if anything. Of two alike the first is taken.
    """
    best: Nearest | None = None
    for index, (place, counts, rank) in enumerate(places):
        rank = jnp.where(counts, place.squared if rank is None else rank, jnp.inf)
        if best is None:
            zero = jnp.zeros_like(rank)
            nobody = jnp.full_like(rank, -1, jnp.int32)
            best = Nearest(counts & False, Offset(zero, zero), jnp.full_like(rank, jnp.inf), nobody)
        closer = rank < best.rank
        dx, dy = (jnp.where(closer, new, old) for new, old in zip(place, best.offset, strict=True))
        which = jnp.where(closer, index, best.index)
        best = Nearest(best.there | closer, Offset(dx, dy), jnp.minimum(rank, best.rank), which)
    assert best is not None
    return best


def others(position: Float[Array, "agents 2 *worlds"]) -> Nearest:
    """The nearest other agent; needs two agents at least."""
    who = jnp.arange(len(position)).reshape(-1, *(1,) * (position.ndim - 2))
    return nearest(
        (offset(position, place), jnp.broadcast_to(who != other, position[:, 0].shape), None)
        for other, place in enumerate(position)
    )


def closeness(squared_distance: Float[Array, "*any"], full: float) -> Float[Array, "*any"]:
    """min(1, full / distance), in (0, 1]: what "go to" is paid."""
    # The bound under the root gives both the minimum with 1 and a finite value at distance 0.
    return full / jnp.sqrt(jnp.maximum(squared_distance, full**2))


def either(masks: Iterable[Bool[Array, "*any"]]) -> Bool[Array, "*any"]:
    """Where any of several masks holds; needs one at least."""
    return functools.reduce(jnp.logical_or, masks)
