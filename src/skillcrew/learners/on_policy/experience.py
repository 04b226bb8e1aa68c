"""Whole episodes of a team, side by side: what on-policy learners learn from."""

from collections.abc import Callable
from typing import TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Key, PyTree

State = TypeVar("State", bound=PyTree)


class Experience(eqx.Module):
    """One episode in each world, from its first step; steps after its end are padding.

    `create` makes padding harmless: whatever stood there is replaced by zeros.
    """

    observation: Float[Array, "later worlds agents obs"]
    """Before each step, and after the last one."""
    taken: Array
    """Int[time worlds agents] of the choices that were made, or Float[time worlds agents act]."""
    reward: Float[Array, "time worlds agents"]
    terminated: Bool[Array, "time worlds"]
    """Nothing follows. A time limit is no such end: what would follow is bootstrapped."""
    mask: Bool[Array, "time worlds"]
    """True for the steps that count."""
    decides: Bool[Array, "time worlds agents"]
    """Whether the agent had a choice, and was not bound to an earlier one. False in padding."""

    @classmethod
    def create(
        cls,
        observation: Float[Array, "time worlds agents obs"],
        next_observation: Float[Array, "time worlds agents obs"],
        taken: Array,
        reward: Float[Array, "time worlds agents"],
        terminated: Bool[Array, "time worlds"],
        mask: Bool[Array, "time worlds"],
        decides: Bool[Array, "time worlds agents"],
    ) -> "Experience":
        """Of what was lived."""
        # The step after an episode's last one is padding, but what is seen there is bootstrapped from.
        seen = jnp.concatenate([mask[:1], mask])[..., None, None]
        first = jnp.concatenate([observation[:1], next_observation])
        counts = mask[..., None]
        return cls(
            observation=jnp.where(seen, first, 0.0),
            taken=jnp.where(counts.reshape(*mask.shape, *(1,) * (taken.ndim - 2)), taken, 0),
            reward=jnp.where(counts, reward, 0.0),
            terminated=terminated & mask,
            mask=mask,
            decides=decides & counts,
        )

    @property
    def worlds(self) -> int:
        """How many episodes there are."""
        return self.mask.shape[1]

    def of(self, worlds: Array) -> "Experience":
        """Those of some of the worlds, by their indices."""
        return jax.tree.map(lambda leaf: leaf[:, worlds], self)


def mean_where(values: Float[Array, "*any"], counts: Bool[Array, "*any"]) -> Float[Array, ""]:
    """The mean of the values that count; 0 of none."""
    return jnp.where(counts, values, 0.0).sum() / jnp.maximum(counts.sum(dtype=values.dtype), 1.0)


def each_minibatch(
    key: Key[Array, ""],
    worlds: int,
    minibatches: int,
    epochs: int,
    update: Callable[[State, Array], tuple[State, dict[str, Array]]],
    state: State,
) -> tuple[State, dict[str, Array]]:
    """Deals the worlds out to minibatches, anew in each epoch, and updates on each.

    Args:
        minibatches: must divide `worlds`.
        update: of a state and the indices of a minibatch's worlds; gives metrics too.

    Returns:
        The last state, and the means of the metrics.
    """

    def epoch(state: State, key: Key[Array, ""]) -> tuple[State, dict[str, Array]]:
        dealt = jax.random.permutation(key, worlds).reshape(minibatches, -1)
        return jax.lax.scan(update, state, dealt)

    state, metrics = jax.lax.scan(epoch, state, jax.random.split(key, epochs))
    return state, jax.tree.map(jnp.mean, metrics)
