"""Agents that are told who they are live in the same world; all numbers differ."""

import jax
import jax.numpy as jnp
import numpy as np

from skillcrew.envs.identified import Identified, identify
from skillcrew.envs.rover.config import RoverConfig
from skillcrew.envs.rover.world import RoverDomain

AGENTS, WORLDS = 3, 5
ENV = RoverDomain(RoverConfig(n_agents=AGENTS, n_poi_types=2, spatial_coupling=2, world_size=4.0))
TOLD = Identified(ENV)
WIDTH = ENV.observation_size


def test_each_agent_is_told_its_own_place() -> None:
    told = identify(jnp.full((AGENTS, 4, WORLDS), 0.5))
    assert told.shape == (AGENTS, 4 + AGENTS, WORLDS)
    for world in range(WORLDS):
        np.testing.assert_array_equal(told[:, 4:, world], np.eye(AGENTS))
    np.testing.assert_array_equal(identify(jnp.full((AGENTS, 4), 0.5)), told[..., 0])


def test_nothing_else_changes() -> None:
    assert TOLD.observation_size == WIDTH + AGENTS
    assert (TOLD.n_agents, TOLD.action_size, TOLD.skills) == (AGENTS, 2, ENV.skills)
    assert TOLD.describe() == ENV.describe()
    keys = jax.random.split(jax.random.key(0), WORLDS)
    actions = jax.random.uniform(jax.random.key(1), (AGENTS, 2, WORLDS), minval=-1.0)

    def live(keys, actions):
        plain, seen = ENV.reset_worlds(keys)
        told, told_seen = TOLD.reset_worlds(keys)
        one, other = ENV.step_worlds(plain, actions, keys)[1], TOLD.step_worlds(told, actions, keys)[1]
        return seen, told_seen, one, other

    seen, told_seen, one, other = jax.device_get(jax.jit(live)(keys, actions))
    np.testing.assert_array_equal(told_seen[:, :WIDTH], seen)
    np.testing.assert_array_equal(other.observation[:, :WIDTH], one.observation)
    np.testing.assert_array_equal(other.observation[:, WIDTH:, 0], np.eye(AGENTS))
    for field in ("local_rewards", "team_reward", "terminated", "truncated"):
        np.testing.assert_array_equal(getattr(other, field), getattr(one, field))
