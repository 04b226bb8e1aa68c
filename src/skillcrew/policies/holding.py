"""Choices that are kept for a least number of steps."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Int, Num


def hold(
    left: Num[Array, "*any"], kept: Num[Array, "*any"], wanted: Num[Array, "*any"], steps: int
) -> tuple[Num[Array, "*any"], Num[Array, "*any"]]:
    """The choice of a step, and for how many steps it is kept yet.

    Args:
        left: steps for which the last choice is kept yet; none, and what is wanted counts.
        kept: the last choice; -1 for none.
        steps: for which a new choice is kept, this one included.
    """
    choice = jnp.where(left > 0, kept, wanted)
    return choice, jnp.where(choice == kept, left, steps) - 1


def decided(choice: Int[Array, "time *any"], steps: int) -> Bool[Array, "time *any"]:
    """At which steps of an episode there was a choice, where each new one is kept for so many steps."""
    if steps == 1:
        return jnp.ones(choice.shape, bool)

    def one_step(carry, taken):
        left, kept = carry
        free = left <= 0
        taken, left = hold(left, kept, taken, steps)
        return (left, taken), free

    nothing = jnp.zeros(choice.shape[1:], jnp.int32)
    return jax.lax.scan(one_step, (nothing, nothing - 1), choice)[1]
