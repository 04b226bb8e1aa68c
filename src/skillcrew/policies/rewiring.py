"""Networks over other observations than those that they were trained on."""

import dataclasses
from typing import TypeVar

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from skillcrew.policies.action_values import ActionValues
from skillcrew.policies.actor import Actor
from skillcrew.policies.critic import Critic
from skillcrew.policies.network import MLP

Inputs = tuple[int | None, ...]
"""For each number of the new observation its place in the old one; None where the old one has no such."""

Policy = TypeVar("Policy", Actor, ActionValues, Critic)


def rewired(policy: Policy, inputs: Inputs, observation_size: int) -> Policy:
    """The same network over another observation: what it did not know is ignored, what is gone counts as 0.

    Args:
        policy: ends in an `MLP`; leaves may have leading axes.
        observation_size: of the old one. What a network sees behind it, as a critic does the action, stays
            behind the new one.
    """
    network = policy.network
    assert isinstance(network, MLP)
    first, *others = network.weights
    behind = range(observation_size, first.shape[-2])
    weights = (_rows(first, (*inputs, *behind)), *others)
    return dataclasses.replace(policy, network=MLP(weights, network.biases))


def _rows(weight: Float[Array, "*any old units"], inputs: Inputs) -> Float[Array, "*any new units"]:
    """Each input's row of weights, of zeros for those that there were not."""
    known = np.array([place is not None for place in inputs])
    rows = weight[..., np.array([place or 0 for place in inputs]), :]
    return jnp.where(jnp.broadcast_to(jnp.asarray(known)[:, None], rows.shape), rows, 0.0)
