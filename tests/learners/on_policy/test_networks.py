"""What critics see, and that one for all agents says the same as if each agent asked it alone."""

from typing import Any, Literal

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from oracles import on_policy as oracle
from skillcrew.learners.on_policy.networks import Critics, Players
from skillcrew.policies.memory import MemoryNetwork, PolicyConfig
from skillcrew.policies.network import scale_input
from skillcrew.policies.stochastic import Options

EXTRA, OUTPUTS = 3, 2
PLAYERS = Players(oracle.AGENTS, oracle.OBSERVATION, Options(4))


def said(critic: MemoryNetwork, joint: np.ndarray, beside: np.ndarray) -> np.ndarray:
    """Step by step, in one world: what a critic says of what all see, and of what is seen beside it."""
    memory, found = critic.initial_memory(), []
    for of_all, other in zip(jnp.asarray(joint), jnp.asarray(beside), strict=True):
        if critic.unit is not None:
            memory = critic.unit(scale_input(of_all, critic.input_scaling), memory)
        seen = scale_input(jnp.concatenate([of_all, other]), critic.input_scaling)
        found.append(critic.network(jnp.concatenate([seen, memory])))
    return np.stack(found)


@pytest.mark.parametrize("hidden", [(), (8, 7)])
@pytest.mark.parametrize("extra", [0, EXTRA])
@pytest.mark.parametrize("memory", [0, 6])
@pytest.mark.parametrize("sharing", ["team", "agent"])
def test_critics_of_all_are_asked_by_everybody(
    hidden: tuple[int, ...], extra: int, memory: int, sharing: Literal["team", "agent"]
) -> None:
    config = PolicyConfig(hidden=hidden, memory=memory, sharing=sharing, input_scaling="sqrt")
    critics = Critics(PLAYERS, config, "joint", extra, OUTPUTS)
    networks = jax.jit(critics.create)(jax.random.key(0))
    # Else its input's order would not matter: biases begin at 0.
    networks = jax.tree.map(lambda leaf: leaf + jnp.linspace(0, 1, leaf.size).reshape(leaf.shape), networks)
    observation = np.asarray(oracle.lived(0).observation)
    beside = np.random.default_rng(1).normal(size=(*observation.shape[:3], extra)).astype(np.float32)
    found = jax.jit(critics)(networks, observation, beside if extra else None)
    assert found.shape == (oracle.TIME + 1, oracle.WORLDS, oracle.AGENTS, OUTPUTS)
    joint = observation[:, 2].reshape(oracle.TIME + 1, -1)
    for agent in range(oracle.AGENTS):
        own = jax.tree.map(lambda leaf, of=agent if sharing == "agent" else 0: leaf[of], networks)
        whose = np.tile(np.eye(oracle.AGENTS, dtype=np.float32)[agent], (oracle.TIME + 1, 1))
        expected = said(own, joint, np.concatenate([whose, beside[:, 2, agent]], axis=-1))
        np.testing.assert_allclose(found[:, 2, agent], expected, rtol=1e-4, atol=1e-4)


def gradient(critics: Critics, networks: MemoryNetwork, observation: Any) -> Any:
    return jax.grad(lambda given: (critics.values(given, observation) ** 2).mean())(networks)


@pytest.mark.parametrize("memory", [0, 5])
def test_one_learns_as_one_for_each_agent_of_equal_weights_does_in_sum(memory: int) -> None:
    shared = Critics(PLAYERS, PolicyConfig(hidden=(8,), memory=memory, sharing="team"), "joint")
    own = Critics(PLAYERS, PolicyConfig(hidden=(8,), memory=memory, sharing="agent"), "joint")
    networks = jax.jit(shared.create)(jax.random.key(3))
    copies = jax.tree.map(lambda leaf: jnp.repeat(leaf, oracle.AGENTS, axis=0), networks)
    observation = oracle.lived(1).observation
    one = jax.jit(lambda given: gradient(shared, given, observation))(networks)
    each = jax.jit(lambda given: gradient(own, given, observation))(copies)
    for together, apart in zip(jax.tree.leaves(one), jax.tree.leaves(each), strict=True):
        np.testing.assert_allclose(together[0], np.asarray(apart).sum(0), rtol=1e-4, atol=1e-6)
