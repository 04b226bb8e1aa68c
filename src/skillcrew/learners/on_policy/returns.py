"""Advantages and returns of whole episodes: sums of temporal differences."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float


def advantages(
    reward: Float[Array, "time worlds agents"],
    value: Float[Array, "later worlds agents"],
    terminated: Bool[Array, "time worlds"],
    mask: Bool[Array, "time worlds"],
    discount: float,
    trace: float,
) -> Float[Array, "time worlds agents"]:
    """Generalised advantage estimates (Schulman et al. 2016); 0 in padding.

    A_t = δ_t + γ λ A_{t+1}, δ_t = r_t + γ (1 - terminated_t) V_{t+1} - V_t, and A = 0 after an episode's
    last step. A time limit bootstraps from what is seen after it, a termination from nothing.

    Args:
        value: before each step and after the last one.
        trace: λ; 0 for one step's difference, 1 for the whole return.
    """
    goes_on = discount * (1.0 - terminated.astype(reward.dtype))[..., None]
    delta = jnp.where(mask[..., None], reward + goes_on * value[1:] - value[:-1], 0.0)
    # Padding has no advantage, so that nothing comes back from there.
    carried = jnp.where(mask[..., None], discount * trace, 0.0)

    def backwards(after: Array, step: tuple[Array, Array]) -> tuple[Array, Array]:
        difference, share = step
        here = difference + share * after
        return here, here

    return jax.lax.scan(backwards, jnp.zeros_like(delta[0]), (delta, carried), reverse=True)[1]


def returns(
    reward: Float[Array, "time worlds agents"],
    value: Float[Array, "later worlds agents"],
    terminated: Bool[Array, "time worlds"],
    mask: Bool[Array, "time worlds"],
    discount: float,
    trace: float,
) -> Float[Array, "time worlds agents"]:
    """λ-returns, the targets of TD(λ): G_t = r_t + γ ((1 - λ) V_{t+1} + λ G_{t+1}) (Sutton and Barto 2018).

    Args: as for `advantages`, of which they are the sum with the values.
    """
    return advantages(reward, value, terminated, mask, discount, trace) + value[:-1]


def paid_apart(
    reward: Float[Array, "time worlds agents"],
    mask: Bool[Array, "time worlds"],
    counts: Bool[Array, "time worlds agents"],
    discount: float,
) -> Float[Array, ""]:
    """The deviation of what was paid from each step to the end of its episode.

    No critic has a part in it; 0 where nobody was paid anything.
    """
    nothing = jnp.zeros((len(reward) + 1, *reward.shape[1:]), reward.dtype)
    paid = advantages(reward, nothing, jnp.zeros_like(mask), mask, discount, 1.0)
    return _centred(paid, counts)[1]


def standardised(
    values: Float[Array, "time worlds agents"], counts: Bool[Array, "time worlds agents"]
) -> Float[Array, "time worlds agents"]:
    """Advantages less their mean and over their deviation.

    Args:
        counts: which of them count.
    """
    centred, deviation = _centred(values, counts)
    return centred / deviation


def share_paid(
    values: Float[Array, "time worlds agents"],
    counts: Bool[Array, "time worlds agents"],
    apart: Float[Array, ""],
) -> Float[Array, ""]:
    """How much of standardised advantages to follow: all, or less where less was paid than they deviate by.

    Where nobody was paid anything, all that advantages differ by is their critic's error. Brought to
    deviation 1 it would make policies sure of something before they know anything.

    Args:
        values: before they are standardised.
        apart: see `paid_apart`.
    """
    return jnp.minimum(apart / _centred(values, counts)[1], 1.0)


def _centred(
    values: Float[Array, "time worlds agents"], counts: Bool[Array, "time worlds agents"]
) -> tuple[Float[Array, "time worlds agents"], Float[Array, ""]]:
    """Values less their mean, and their deviation, of those that count."""
    number = jnp.maximum(counts.sum(dtype=values.dtype), 1.0)
    centred = values - jnp.where(counts, values, 0.0).sum() / number
    variance = jnp.where(counts, centred**2, 0.0).sum() / number
    # The least bit of variance, so that there is a derivative where all are equal.
    return centred, jnp.sqrt(variance + 1e-16)
