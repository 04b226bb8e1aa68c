"""A network along episodes says what it says step by step."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array

from oracles import on_policy as oracle
from skillcrew.learners.on_policy.unroll import unrolled
from skillcrew.policies.memory import MemoryNetwork, PolicyConfig, for_each_agent, initial_memories


def created(config: PolicyConfig, count: int) -> MemoryNetwork:
    """So many networks, made by one program."""
    create = jax.vmap(lambda key: MemoryNetwork.create(key, oracle.OBSERVATION, 2, config))
    return jax.jit(create)(jax.random.split(jax.random.key(0), count))


@pytest.mark.parametrize("memory", [0, 6])
@pytest.mark.parametrize("count", [1, oracle.AGENTS])
def test_it_is_the_network_step_by_step(memory: int, count: int) -> None:
    config = PolicyConfig(hidden=(8,), memory=memory, input_scaling="symlog")
    networks = created(config, count)
    observation = np.asarray(oracle.lived(0).observation)
    found = np.asarray(jax.jit(unrolled)(networks, observation))
    each = jax.jit(lambda *given: for_each_agent(MemoryNetwork.__call__, *given))
    for world in range(oracle.WORLDS):
        held = initial_memories(networks, oracle.AGENTS)
        for time in range(oracle.TIME + 1):
            outputs, held = each(networks, observation[time, world], held)
            np.testing.assert_allclose(found[time, world], outputs, rtol=1e-5, atol=1e-5)


def test_no_step_depends_on_a_later_one_or_on_another_agent() -> None:
    config = PolicyConfig(hidden=(8,), memory=5)
    networks = created(config, 1)
    observation = np.asarray(oracle.lived(1).observation)
    other = observation.copy()
    other[4, 2, 1] += 1.0
    along = jax.jit(unrolled)
    changed = np.asarray(along(networks, other)) - np.asarray(along(networks, observation))
    where = np.argwhere(np.abs(changed).sum(-1) > 1e-6)
    assert where.tolist() == [[time, 2, 1] for time in range(4, oracle.TIME + 1)]


@pytest.mark.parametrize("count", [1, oracle.AGENTS])
def test_its_gradient_is_that_of_the_network_step_by_step(count: int) -> None:
    networks = created(PolicyConfig(hidden=(8,), memory=6, input_scaling="symlog"), count)
    observation = jnp.asarray(oracle.lived(0).observation)
    weights = np.random.default_rng(2).normal(size=(*observation.shape[:3], 2)).astype(np.float32)

    def step_by_step(networks: MemoryNetwork, seen: Array) -> Array:
        def one_step(held: Array, now: Array) -> tuple[Array, Array]:
            outputs, held = for_each_agent(MemoryNetwork.__call__, networks, now, held)
            return held, outputs

        return jax.lax.scan(one_step, initial_memories(networks, oracle.AGENTS), seen)[1]

    def gradient(along: Callable[..., Array]) -> Callable[[MemoryNetwork], MemoryNetwork]:
        return jax.grad(lambda given: (along(given, observation) * weights).sum())

    worlds = jax.vmap(step_by_step, in_axes=(None, 1), out_axes=1)
    both = jax.jit(lambda given: (gradient(unrolled)(given), gradient(worlds)(given)))
    found, expected = both(networks)
    for here, there in zip(jax.tree.leaves(found), jax.tree.leaves(expected), strict=True):
        assert np.abs(there).max() > 0
        np.testing.assert_allclose(here, there, rtol=1e-3, atol=1e-3)
