"""Our environments behind JaxMARL's interface, by the calls of JaxMARL's own test of it."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

pytest.importorskip("jaxmarl")

from jaxmarl.environments import MultiAgentEnv
from jaxmarl.environments.spaces import Space
from jaxmarl.wrappers.baselines import LogWrapper

import skillcrew as sc
from oracles.mixed import Mixed, MixedDiscrete
from oracles.picking import Picking


@functools.cache
def rover():
    return sc.make("rover-t2-c2", episode_length=4, activation_distance=9.0)


OURS = {"rover": rover, "picking": Picking, "mixed": Mixed, "mixed discrete": MixedDiscrete}


def drawn(env, key):
    keys = jax.random.split(key, env.num_agents)
    return {agent: env.action_space(agent).sample(own) for agent, own in zip(env.agents, keys, strict=True)}


@pytest.mark.parametrize("name", OURS)
def test_it_is_what_jaxmarl_takes(name):
    """What JaxMARL 0.2.0 asks in its tests/test_envs_implement_base_api.py, and a little more."""
    inner = OURS[name]()
    env = sc.jaxmarl_env(inner)
    assert isinstance(env, MultiAgentEnv)
    assert list(env.observation_spaces) == list(env.action_spaces) == list(env.agents)
    assert len(env.agents) == env.num_agents == inner.n_agents
    for agent in env.agents:
        assert env.observation_spaces[agent] == env.observation_space(agent)
        assert env.action_spaces[agent] == env.action_space(agent)
        assert isinstance(env.observation_space(agent), Space)
        assert isinstance(env.action_space(agent), Space)
    key_reset, key_draw, key_step = jax.random.split(jax.random.key(0), 3)
    seen, state = env.reset(key_reset)
    actions = drawn(env, key_draw)
    result = env.step(key_step, state, actions)
    assert isinstance(result, tuple) and len(result) == 5
    after, next_state, rewards, done, info = result
    for observation in (seen, after):
        for agent in env.agents:
            space = env.observation_space(agent)
            assert observation[agent].shape == space.shape
            assert space.contains(observation[agent])
    assert set(rewards) == set(env.agents)
    assert set(done) == {*env.agents, "__all__"}
    assert {value.dtype for value in done.values()} == {jnp.dtype(bool)}
    assert isinstance(info, dict)
    assert jax.tree.structure(state) == jax.tree.structure(next_state)
    assert {agent: mask.shape for agent, mask in env.get_avail_actions(state).items()} == {
        agent: (space.shape or (space.n,)) for agent, space in env.action_spaces.items()
    }
    named = [agent for agents in env.agent_classes.values() for agent in agents]
    assert named == list(env.agents)


def test_it_steps_as_ours_does_and_begins_anew_when_it_is_over():
    inner = rover()
    env = sc.jaxmarl_env(inner)
    assert (env.name, env.max_steps) == ("rover-t2-c2", 4)
    key = jax.random.key(3)
    seen, state = env.reset(key)
    ours, observation = inner.reset(key)
    advance = jax.jit(inner.step)
    np.testing.assert_allclose([seen["agent_0"], seen["agent_1"]], observation, rtol=1e-5)
    for _ in range(4):
        key, key_draw = jax.random.split(key)
        actions = {
            a: env.action_space(a).sample(k)
            for a, k in zip(env.agents, jax.random.split(key_draw), strict=True)
        }
        # As JaxMARL's `step` draws them.
        key_step, key_reset = jax.random.split(key)
        ours, step = advance(ours, jnp.stack([actions["agent_0"], actions["agent_1"]]), key_step)
        before = state
        seen, state, rewards, done, info = env.step(key, state, actions)
        over = bool(step.terminated | step.truncated)
        assert bool(done["__all__"]) == bool(done["agent_1"]) == over
        assert float(rewards["agent_0"]) == float(rewards["agent_1"]) == float(step.team_reward)
        np.testing.assert_array_equal(info["team_reward"], [step.team_reward] * 2)
        np.testing.assert_array_equal(info["terminated"], [step.terminated] * 2)
        if over:
            fresh, begun = env.reset(key_reset)
            np.testing.assert_allclose(seen["agent_1"], fresh["agent_1"], rtol=1e-5)
            assert not state.done and state.step == 0
            jax.tree.map(functools.partial(np.testing.assert_allclose, rtol=1e-5), state, begun)
            break
        np.testing.assert_allclose([seen["agent_0"], seen["agent_1"]], step.observation, rtol=1e-5)
    assert over, "four steps are all that there are"
    # To a state of the caller's choice, as JaxMARL's tests/test_jaxmarl_api.py has it.
    _, chosen = env.reset(jax.random.key(8))
    seen, state, _, done, _ = env.step(key, before, actions, reset_state=chosen)
    assert done["__all__"]
    jax.tree.map(functools.partial(np.testing.assert_allclose, rtol=1e-5), state, chosen)
    np.testing.assert_array_equal(seen["agent_0"], env.get_obs(chosen)["agent_0"])


@pytest.mark.parametrize("kind", [Mixed, MixedDiscrete])
def test_agents_that_differ_are_called_by_their_type_and_paid_their_own_skills(kind):
    inner = kind()
    env = sc.jaxmarl_env(inner, ["scout/right", "hauler/lift", "hauler/wait"])
    assert env.agent_classes == {"scout": ["scout_0", "scout_1"], "hauler": ["hauler_0"]}
    key = jax.random.key(1)
    _, state = env.reset(key)
    actions = {
        a: env.action_space(a).sample(k) for a, k in zip(env.agents, jax.random.split(key, 3), strict=True)
    }
    _, _, rewards, _, _ = env.step_env(key, state, actions)
    action = {
        "scout": jnp.stack([actions["scout_0"], actions["scout_1"]]),
        "hauler": actions["hauler_0"][None],
    }
    _, step = inner.step(inner.reset(key)[0], action, key)
    local = step.local_rewards
    np.testing.assert_allclose([rewards["scout_0"], rewards["scout_1"]], local["scout"][:, 1])
    np.testing.assert_allclose(rewards["hauler_0"], local["hauler"][0, 0] + local["hauler"][0, 1])


def test_jaxmarls_wrapper_counts_its_returns():
    env = LogWrapper(sc.jaxmarl_env(Picking(), ("follow", "next")))
    key = jax.random.key(0)
    _, state = env.reset(key)
    total = np.zeros(3)
    for _ in range(12):
        key, key_draw = jax.random.split(key)
        _, state, rewards, done, info = env.step(key, state, drawn(env, key_draw))
        total += [rewards[agent] for agent in env.agents]
    assert done["__all__"]
    np.testing.assert_allclose(info["returned_episode_returns"], total)
    np.testing.assert_array_equal(info["returned_episode_lengths"], [12] * 3)


def test_skills_that_there_are_not():
    with pytest.raises(sc.UserError, match=r"unknown skill of picking 'folow'; .* first: follow, next"):
        sc.jaxmarl_env(Picking(), ("folow",))
    with pytest.raises(sc.UserError, match=r"skills = 'follow': give a list of names"):
        sc.jaxmarl_env(Picking(), "follow")
