"""When a POI counts as observed: which types are allowed to be, and how many rovers it takes."""

import functools

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from skillcrew.envs.rover.crew import Ranks

PerType = Bool[Array, "types *worlds"]


def types_observed(observed: Bool[Array, "pois *worlds"], pois_per_type: int) -> PerType:
    """A type is observed with the first of its POIs. POIs are ordered by type."""
    by_type = observed.reshape(-1, pois_per_type, *observed.shape[1:])
    return functools.reduce(jnp.logical_or, (by_type[:, i] for i in range(pois_per_type)))


def unlocked_by_parents(done: PerType, parents: tuple[tuple[int, ...], ...]) -> PerType:
    """The types all of whose parents are observed."""
    return jnp.stack(
        [
            functools.reduce(jnp.logical_and, (done[p] for p in above), jnp.ones_like(done[0]))
            for above in parents
        ]
    )


def unlocked_in_order(done: PerType, order: Int[Array, "types *worlds"]) -> PerType:
    """The types before which no unobserved one stands in the order (see `RoverState.order`)."""
    return jnp.stack([(done | (order >= place[None])).all(0) for place in order])


def next_in_order(done: PerType, order: Int[Array, "types *worlds"]) -> PerType:
    """True for the first unobserved type of the order, and for none once all are observed."""
    return unlocked_in_order(done, order) & ~done


def visited(
    squared_distance: Float[Array, "pois agents *worlds"],
    unlocked: PerType,
    groups: tuple[tuple[int, ...], ...],
    pois_per_type: int,
    crew: Ranks,
    activation_distance: float,
    copies: Int[Array, " agents"] | None = None,
) -> Bool[Array, "pois *worlds"]:
    """Which POIs meet all couplings in this step, observed before or not (thesis, section 4.1).

    Spatial: of each type of rovers at least its `coupling` within `activation_distance` at this very step.
    Temporal: the type is unlocked by what was observed at *earlier* steps. Simultaneous: the same
    holds of a POI of each other type of its group.

    Args:
        squared_distance: infinite for a rover that does not count.
        unlocked: before this step.
        groups: types by the group that they are in, each type in exactly one.
        copies: as how many each rover counts; by default as one.
    """
    near = (squared_distance <= activation_distance**2).astype(jnp.int32)
    if copies is not None:
        near = near * copies.reshape(1, -1, *(1,) * (near.ndim - 2))
    demands = [near[:, rows].sum(1, dtype=jnp.int32) >= kind.coupling for kind, rows in crew if kind.coupling]
    enough = functools.reduce(jnp.logical_and, demands)
    met = types_observed(enough, pois_per_type) & unlocked
    others = {kind: [other for other in group if other != kind] for group in groups for kind in group}
    ready = [
        functools.reduce(jnp.logical_and, (met[other] for other in others[kind]), unlocked[kind])
        for kind in range(len(unlocked))
    ]
    return jnp.stack([enough[poi] & ready[poi // pois_per_type] for poi in range(len(enough))])


def visiting_distance(
    squared_distance: Float[Array, "pois agents *worlds"],
    crew: Ranks,
    copies: Int[Array, " agents"] | None = None,
) -> Float[Array, "pois *worlds"]:
    """The mean distance, in metres, of the rovers that a POI takes: of each type the `coupling` closest.

    Infinite, or too small, where there are fewer.

    Args:
        squared_distance: infinite for a rover that does not count.
        copies: as how many each rover counts; by default as one.
    """
    if copies is None:
        copies = jnp.ones(squared_distance.shape[1], jnp.int32)
    distance = jnp.sqrt(squared_distance)
    needed = [(kind.coupling, rows) for kind, rows in crew if kind.coupling]
    sums = [_sum_of_closest(distance[:, rows], copies[rows], count) for count, rows in needed]
    return functools.reduce(jnp.add, sums) / sum(count for count, _ in needed)


def _sum_of_closest(
    distance: Float[Array, "pois agents *worlds"], copies: Int[Array, " agents"], count: int
) -> Float[Array, "pois *worlds"]:
    """Over the `count` closest, one that is there several times counting as often as that."""
    agents, ones = distance.shape[1], (1,) * (distance.ndim - 2)
    mine, others = distance[:, :, None], distance[:, None]
    # Of those at the same distance the first ones are taken as the closer ones, so that none is taken twice.
    first = jnp.tri(agents, k=-1, dtype=bool).reshape(1, agents, agents, *ones)
    closer = ((others < mine) | ((others == mine) & first)).astype(jnp.int32)
    before = (closer * copies.reshape(1, 1, agents, *ones)).sum(2, dtype=jnp.int32)
    taken = jnp.clip(count - before, 0, copies.reshape(1, agents, *ones))
    # A rover that does not count is infinitely far, and not taken, as a rule: infinity times 0 is no number.
    return jnp.where(taken > 0, taken.astype(distance.dtype) * distance, 0.0).sum(1)
