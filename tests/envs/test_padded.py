"""Agents that differ, as arrays over all of them and back."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from oracles.mixed import HAULER, SCOUT, SCOUTS, SKILLS, Mixed, MixedDiscrete
from skillcrew.envs.agent_type import AgentType
from skillcrew.envs.padded import Padded, by_type, in_rows, types_of_agents, uniform
from skillcrew.errors import UserError


def test_sizes_and_skills_follow_from_the_types():
    env = Mixed()
    assert (env.n_agents, env.observation_size, env.action_size) == (3, 5, 2)
    assert env.skills == SKILLS
    assert types_of_agents(env) == (0, 0, 1)
    with pytest.raises(AttributeError, match="Mixed has no colour"):
        _ = env.colour


def test_what_is_shorter_ends_in_zeros():
    seen = {"scout": jnp.arange(1.0, 7).reshape(2, 3), "hauler": jnp.arange(7.0, 12).reshape(1, 5)}
    expected = [[1, 2, 3, 0, 0], [4, 5, 6, 0, 0], [7, 8, 9, 10, 11]]
    np.testing.assert_array_equal(in_rows((SCOUT, HAULER), seen), expected)


def test_each_type_gets_its_own_part_of_an_action():
    action = jnp.arange(1.0, 7).reshape(3, 2)
    parts = by_type((SCOUT, HAULER), action, discrete=False)
    np.testing.assert_array_equal(parts["scout"], [[1], [3]])
    np.testing.assert_array_equal(parts["hauler"], [[5, 6]])
    # With 2 and 3 actions of their own, the third one of a scout is its first again.
    picked = by_type(MixedDiscrete.types, jnp.array([2, 1, 2]), discrete=True)
    np.testing.assert_array_equal(picked["scout"], [0, 1])
    np.testing.assert_array_equal(picked["hauler"], [2])


@pytest.mark.parametrize("kind", [Mixed, MixedDiscrete])
def test_a_step_is_that_of_the_environment_itself(kind):
    env, key = kind(), jax.random.key(1)
    padded = uniform(env)
    assert isinstance(padded, Padded)
    state, seen = padded.reset(key)
    own_state, own_seen = env.reset(key)
    np.testing.assert_array_equal(seen[:SCOUTS, :3], own_seen["scout"])
    np.testing.assert_array_equal(seen[SCOUTS:], own_seen["hauler"])
    action = jnp.array([[-0.9, 0.3], [0.7, 0.2], [0.1, 0.8]]) if kind is Mixed else jnp.array([0, 1, 2])
    _, step = padded.step(state, action, key)
    _, own = env.step(own_state, by_type(env.types, action, discrete=kind is MixedDiscrete), key)
    rewards = np.zeros((3, 5))
    rewards[:SCOUTS, :2] = own.local_rewards["scout"]
    rewards[SCOUTS:, 2:] = own.local_rewards["hauler"]
    np.testing.assert_array_equal(step.local_rewards, rewards)
    assert np.abs(rewards).sum() > 1


def test_many_worlds_are_many_times_one():
    env = uniform(Mixed())
    keys = jax.random.split(jax.random.key(2), 4)
    state, seen = env.reset_worlds(keys)
    action = jnp.linspace(-1, 1, 24).reshape(3, 2, 4)
    _, step = env.step_worlds(state, action, keys)
    for world in range(4):
        one, alone = env.reset(keys[world])
        np.testing.assert_array_equal(seen[..., world], alone)
        _, expected = env.step(one, action[..., world], keys[world])
        np.testing.assert_array_equal(step.local_rewards[..., world], expected.local_rewards)
        np.testing.assert_array_equal(step.observation[..., world], expected.observation)


def test_an_environment_of_like_agents_stays_itself():
    from oracles.toy import Toy

    env = Toy()
    assert uniform(env) is env
    assert types_of_agents(env) == ()


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        ({"agents": 0}, "agent type ant: agents = 0; give a number of at least 1"),
        ({"action_size": True}, "agent type ant: action_size = True; give a number of at least 1"),
        ({"skills": ("a", "a")}, r"agent type ant: skills = \('a', 'a'\); give each name once"),
    ],
)
def test_what_is_no_type_is_refused(fields, expected):
    with pytest.raises(UserError, match=expected):
        AgentType(**{"name": "ant", "agents": 2, "observation_size": 3, "action_size": 1, **fields})
