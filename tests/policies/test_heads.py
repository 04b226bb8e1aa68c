"""A network with a head for each agent, against NumPy; all sizes differ."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from skillcrew.policies.actor import Actor
from skillcrew.policies.heads import MultiHead
from skillcrew.policies.memory import MemoryNetwork
from skillcrew.policies.network import NetworkConfig

SEEN, HIDDEN, HEADS, OUTPUTS = 4, 6, 3, 2


@pytest.mark.parametrize("size_of_one", [1.0, 2.0])
def test_the_trunk_is_shared_and_the_head_is_the_agents(size_of_one: float) -> None:
    """The identity points to a head, whatever input scaling made of its one."""
    network = MultiHead.create(jax.random.key(0), (SEEN + HEADS, HIDDEN, OUTPUTS), HEADS)
    (first, last), (first_bias, last_bias) = network.network.weights, network.network.biases
    assert last.shape == (HIDDEN, HEADS * OUTPUTS)
    seen = np.random.default_rng(0).normal(size=SEEN).astype(np.float32)
    features = np.maximum(seen @ first + first_bias, 0)
    for agent in range(HEADS):
        own = slice(agent * OUTPUTS, (agent + 1) * OUTPUTS)
        expected = features @ last[:, own] + last_bias[own]
        told = jnp.concatenate([seen, size_of_one * jnp.eye(HEADS)[agent]])
        np.testing.assert_allclose(network(told), expected, rtol=1e-5, atol=1e-6)


def test_an_actor_with_heads_acts_alike_as_a_teams_network() -> None:
    config = NetworkConfig(hidden=(HIDDEN,))
    actor = Actor.create(jax.random.key(1), SEEN + HEADS, OUTPUTS, config, HEADS)
    told = jnp.concatenate([jnp.full(SEEN, 0.3), jnp.eye(HEADS)[2]])
    outputs, _ = MemoryNetwork.of_actor(actor)(told, jnp.zeros(0))
    np.testing.assert_allclose(jnp.tanh(outputs), actor(told), rtol=1e-6)


def test_a_heads_gradient_is_its_agents_alone() -> None:
    network = MultiHead.create(jax.random.key(2), (SEEN + HEADS, HIDDEN, OUTPUTS), HEADS)
    told = jnp.concatenate([jnp.full(SEEN, 0.5), jnp.eye(HEADS)[1]])
    gradient = jax.grad(lambda net: net(told).sum())(network)
    by_head = np.abs(gradient.network.weights[-1].reshape(HIDDEN, HEADS, OUTPUTS)).sum((0, 2))
    assert by_head[1] > 0 and by_head[0] == by_head[2] == 0
