"""Loads that several agents have to carry at once: who takes hold, who keeps hold, and where loads go.

A load is lifted by all free agents within reach, if they are as many as it takes. It moves as far as those
who hold it do on average. Who leaves it behind has let go of it; with too few left it is dropped.
"""

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

Held = Bool[Array, "loads agents *worlds"]
"""Who holds what; nobody holds two things."""
Copies = Float[Array, " agents"]
"""How often each agent is there: 1, unless one asks what would be with more of it or without it."""


def lifted(held: Held, copies: Copies, coupling: int) -> Bool[Array, "loads *worlds"]:
    """Which loads enough agents hold."""
    return _count(held, copies) >= coupling


def carried(
    load: Float[Array, "loads 2 *worlds"],
    held: Held,
    moved: Float[Array, "agents 2 *worlds"],
    copies: Copies,
    coupling: int,
) -> Float[Array, "loads 2 *worlds"]:
    """Where loads are once agents have moved: a lifted one went along, as far as its bearers on average."""
    share = _weights(held, copies) / jnp.maximum(_count(held, copies), 1.0)[:, None]
    share = jnp.where(lifted(held, copies, coupling)[:, None], share, 0.0)
    along = [jnp.stack([(one * moved[:, axis]).sum(0) for axis in (0, 1)]) for one in share]
    return load + jnp.stack(along)


def kept(
    held: Held, squared: Float[Array, "loads agents *worlds"], reach: float, copies: Copies, coupling: int
) -> Held:
    """Who still holds what: those within reach, and nobody where they are too few."""
    held = held & (squared <= reach**2)
    return held & lifted(held, copies, coupling)[:, None]


def taken(
    held: Held,
    squared: Float[Array, "loads agents *worlds"],
    available: Bool[Array, "loads *worlds"],
    reach: float,
    copies: Copies,
    coupling: int,
) -> Held:
    """Who holds what after free agents have put hands on the loads that nobody holds.

    Each puts hands on the nearest such load within its reach, the first of two as near.

    Args:
        available: which loads may be lifted at all.
    """
    lying = available & ~held.any(1)
    free = ~held.any(0)
    best = jnp.full_like(squared[0], reach**2)
    choice = jnp.full_like(squared[0], -1, jnp.int32)
    for index, one in enumerate(squared):
        # The first may also be exactly within reach; a later one has to be nearer.
        closer = lying[index][None] & ((one < best) | ((choice < 0) & (one <= best)))
        best, choice = jnp.where(closer, one, best), jnp.where(closer, index, choice)
    put = jnp.stack([free & (choice == index) for index in range(len(squared))])
    return held | (put & lifted(put, copies, coupling)[:, None])


def _weights(held: Held, copies: Copies) -> Float[Array, "loads agents *worlds"]:
    return jnp.where(held, copies.reshape(1, -1, *(1,) * (held.ndim - 2)), 0.0)


def _count(held: Held, copies: Copies) -> Float[Array, "loads *worlds"]:
    return _weights(held, copies).sum(1)
