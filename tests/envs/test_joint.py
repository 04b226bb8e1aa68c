"""A team seen as one agent lives in the same world; all numbers differ."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from skillcrew.envs.joint import Joint, join, part
from skillcrew.envs.rover.config import RoverConfig
from skillcrew.envs.rover.world import RoverDomain

AGENTS, WORLDS = 3, 5
ENV = RoverDomain(RoverConfig(n_agents=AGENTS, n_poi_types=2, spatial_coupling=2, world_size=4.0))
JOINT = Joint(ENV)


def test_sizes_are_those_of_all_agents_together() -> None:
    assert (JOINT.n_agents, JOINT.action_size) == (1, 2 * AGENTS)
    assert JOINT.observation_size == AGENTS * ENV.observation_size
    assert (JOINT.skills, JOINT.name, JOINT.episode_length) == (ENV.skills, ENV.name, ENV.episode_length)
    assert JOINT.describe() == ENV.describe()


def test_agents_stand_in_a_row_and_come_apart_again() -> None:
    of_agents = jnp.arange(AGENTS * 2 * WORLDS, dtype=jnp.float32).reshape(AGENTS, 2, WORLDS)
    joint = join(of_agents)
    assert joint.shape == (1, 2 * AGENTS, WORLDS)
    assert joint[0, :, 0].tolist() == [float(of_agents[a, i, 0]) for a in range(AGENTS) for i in range(2)]
    np.testing.assert_array_equal(part(joint, AGENTS), of_agents)


@pytest.fixture(scope="module")
def lived():
    """Ten steps of both, from the same keys and actions, in many worlds and in the first of them alone."""
    keys = jax.random.split(jax.random.key(0), WORLDS)
    actions = jax.random.uniform(jax.random.key(1), (10, AGENTS, 2, WORLDS), minval=-1.0)

    def run(keys, actions):
        plain, seen = ENV.reset_worlds(keys)
        joint, joint_seen = JOINT.reset_worlds(keys)
        alone, alone_seen = JOINT.reset(keys[0])

        def step(carry, action):
            plain, joint, alone = carry
            plain, one = ENV.step_worlds(plain, action, keys)
            joint, other = JOINT.step_worlds(joint, join(action), keys)
            alone, third = JOINT.step(alone, join(action[..., 0]), keys[0])
            return (plain, joint, alone), (one, other, third)

        return (seen, joint_seen, alone_seen), jax.lax.scan(step, (plain, joint, alone), actions)[1]

    return jax.device_get(jax.jit(run)(keys, actions))


def test_what_it_sees_is_what_all_agents_see(lived) -> None:
    (seen, joint_seen, alone_seen), (plain, joint, alone) = lived
    np.testing.assert_array_equal(joint_seen[0], seen.reshape(-1, WORLDS))
    np.testing.assert_allclose(alone_seen[0], seen[..., 0].ravel(), rtol=1e-5)
    np.testing.assert_array_equal(joint.observation[:, 0], plain.observation.reshape(10, -1, WORLDS))
    np.testing.assert_allclose(alone.observation[:, 0], joint.observation[:, 0, :, 0], rtol=1e-3, atol=1e-4)


def test_rewards_and_ends_are_the_teams_and_local_rewards_are_summed_up(lived) -> None:
    _, (plain, joint, _) = lived
    np.testing.assert_allclose(joint.local_rewards, plain.local_rewards.sum(1, keepdims=True), rtol=1e-5)
    for field in ("team_reward", "terminated", "truncated"):
        np.testing.assert_array_equal(getattr(joint, field), getattr(plain, field))
    assert plain.team_reward.any()
