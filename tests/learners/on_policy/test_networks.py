"""What critics see, and that one for all agents says the same as if each agent asked it alone."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from oracles import on_policy as oracle
from skillcrew.learners.on_policy.networks import Critics, Players
from skillcrew.policies.memory import MemoryNetwork, PolicyConfig
from skillcrew.policies.stochastic import Options

EXTRA, OUTPUTS = 3, 2
PLAYERS = Players(oracle.AGENTS, oracle.OBSERVATION, Options(4))


def said(critic: MemoryNetwork, seen: np.ndarray) -> np.ndarray:
    """Row by row."""
    return np.stack([np.asarray(critic(jnp.asarray(row), jnp.zeros(0))[0]) for row in seen])


@pytest.mark.parametrize("hidden", [(), (8, 7)])
@pytest.mark.parametrize("extra", [0, EXTRA])
def test_one_critic_for_all_is_asked_by_everybody(hidden: tuple[int, ...], extra: int) -> None:
    config = PolicyConfig(hidden=hidden, sharing="team", input_scaling="sqrt")
    critics = Critics(PLAYERS, config, "joint", extra, OUTPUTS)
    networks = jax.jit(critics.create)(jax.random.key(0))
    # Else its input's order would not matter: biases begin at 0.
    networks = jax.tree.map(lambda leaf: leaf + jnp.linspace(0, 1, leaf.size).reshape(leaf.shape), networks)
    observation = np.asarray(oracle.lived(0).observation)
    beside = np.random.default_rng(1).normal(size=(*observation.shape[:3], extra)).astype(np.float32)
    found = jax.jit(critics)(networks, observation, beside if extra else None)
    assert found.shape == (oracle.TIME + 1, oracle.WORLDS, oracle.AGENTS, OUTPUTS)
    alone = jax.tree.map(lambda leaf: leaf[0], networks)
    for agent in range(oracle.AGENTS):
        joint = observation[2].reshape(oracle.WORLDS, -1)
        whose = np.tile(np.eye(oracle.AGENTS, dtype=np.float32)[agent], (oracle.WORLDS, 1))
        seen = np.concatenate([joint, whose, beside[2, :, agent]], axis=-1)
        np.testing.assert_allclose(found[2, :, agent], said(alone, seen), rtol=1e-4, atol=1e-4)


def gradient(critics: Critics, networks: MemoryNetwork, observation: Any) -> Any:
    return jax.grad(lambda given: (critics.values(given, observation) ** 2).mean())(networks)


def test_it_learns_as_one_for_each_agent_of_equal_weights_does_in_sum() -> None:
    shared = Critics(PLAYERS, PolicyConfig(hidden=(8,), sharing="team"), "joint")
    own = Critics(PLAYERS, PolicyConfig(hidden=(8,), sharing="agent"), "joint")
    networks = jax.jit(shared.create)(jax.random.key(3))
    copies = jax.tree.map(lambda leaf: jnp.repeat(leaf, oracle.AGENTS, axis=0), networks)
    observation = oracle.lived(1).observation
    one = jax.jit(lambda given: gradient(shared, given, observation))(networks)
    each = jax.jit(lambda given: gradient(own, given, observation))(copies)
    for together, apart in zip(jax.tree.leaves(one), jax.tree.leaves(each), strict=True):
        np.testing.assert_allclose(together[0], np.asarray(apart).sum(0), rtol=1e-4, atol=1e-6)
