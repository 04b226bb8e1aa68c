"""A network along episodes says what it says step by step."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from oracles import on_policy as oracle
from skillcrew.learners.on_policy.unroll import unrolled
from skillcrew.policies.memory import MemoryNetwork, PolicyConfig, for_each_agent, initial_memories


@pytest.mark.parametrize("memory", [0, 6])
@pytest.mark.parametrize("count", [1, oracle.AGENTS])
def test_it_is_the_network_step_by_step(memory: int, count: int) -> None:
    config = PolicyConfig(hidden=(8,), memory=memory, input_scaling="symlog")
    networks = jax.vmap(lambda key: MemoryNetwork.create(key, oracle.OBSERVATION, 2, config))(
        jax.random.split(jax.random.key(0), count)
    )
    observation = oracle.lived(0).observation
    found = unrolled(networks, observation)
    for world in range(oracle.WORLDS):
        held = initial_memories(networks, oracle.AGENTS)
        for time in range(oracle.TIME + 1):
            seen = observation[time, world]
            outputs, held = for_each_agent(MemoryNetwork.__call__, networks, seen, held)
            np.testing.assert_allclose(found[time, world], outputs, rtol=1e-5, atol=1e-5)


def test_no_step_depends_on_a_later_one_or_on_another_agent() -> None:
    config = PolicyConfig(hidden=(8,), memory=5)
    networks = jax.vmap(lambda key: MemoryNetwork.create(key, oracle.OBSERVATION, 2, config))(
        jax.random.split(jax.random.key(0), 1)
    )
    observation = oracle.lived(1).observation
    changed = unrolled(networks, observation.at[4, 2, 1].add(1.0)) - unrolled(networks, observation)
    where = np.argwhere(np.asarray(jnp.abs(changed).sum(-1)) > 1e-6)
    assert where.tolist() == [[time, 2, 1] for time in range(4, oracle.TIME + 1)]
