"""Our environments in PettingZoo's and Gymnasium's hands."""

import importlib.util

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import skillcrew as sc
from skillcrew.envs.scene import Points, Scene


class Meadow(sc.Environment):
    """Sheep are at a place each; a step moves them by what they do. Offers a scene and a central state."""

    n_agents, observation_size, action_size, episode_length = 2, 3, 2, 5
    skills = ("east", "north", "rest")

    def reset(self, key):
        return (place := jax.random.uniform(key, (self.n_agents, 2))), self.seen(place)

    def step(self, state, action, key):
        after = state + action + 0.1 * jax.random.normal(key, state.shape)
        done = after.sum() > 8
        return after, sc.TimeStep(
            observation=self.seen(after),
            local_rewards=jnp.concatenate([after, -jnp.abs(action).sum(1, keepdims=True)], axis=1),
            team_reward=after.sum(),
            terminated=done,
            truncated=jnp.zeros((), bool),
        )

    def seen(self, place):
        return jnp.concatenate([place, place.sum(1, keepdims=True)], axis=1)

    def central_state(self, state):
        return state.reshape(-1)

    def scene(self, state):
        return Scene((-9.0, -9.0), (9.0, 9.0), points=(Points("agents", state),))


class Farm(sc.Environment):
    """Dogs and a cat choose by index; the skills of both types count up."""

    types = (sc.AgentType("dog", 2, 3, 4, ("bark", "run")), sc.AgentType("cat", 1, 2, 3, ("run",)))
    actions, episode_length = "discrete", 4

    def reset(self, key):
        return jnp.zeros((), jnp.int32), {"dog": jnp.zeros((2, 3)), "cat": jnp.zeros((1, 2))}

    def step(self, state, action, key):
        dog, cat = (action[name].astype(jnp.float32)[:, None] for name in ("dog", "cat"))
        return state + 1, sc.TimeStepByType(
            observation={"dog": jnp.tile(dog, 3), "cat": jnp.tile(cat, 2)},
            local_rewards={"dog": jnp.concatenate([dog, dog * 10], axis=1), "cat": cat * 100},
            team_reward=jnp.float32(0.5),
            terminated=state >= 2,
            truncated=jnp.zeros((), bool),
        )


def lone(cls):
    env = cls()
    env.n_agents = 1
    return env


@pytest.fixture(scope="module")
def suite():
    """PettingZoo's own tests, whose import warns of what they import."""
    import warnings

    pytest.importorskip("pettingzoo")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import pettingzoo.test
    return pettingzoo.test


@pytest.mark.parametrize("kind", [Meadow, Farm])
def test_pettingzoos_own_tests_pass(suite, kind):
    env = kind()
    suite.parallel_api_test(sc.pettingzoo_env(env), 20)
    suite.parallel_seed_test(lambda: sc.pettingzoo_env(env))


def test_steps_are_those_of_the_environment(suite):
    env = Meadow()
    theirs = sc.pettingzoo_env(env)
    seen, _ = theirs.reset(seed=3)
    assert theirs.possible_agents == ["agent_0", "agent_1"] and str(theirs) == "meadow"
    np.testing.assert_array_equal(theirs.state(), np.concatenate([seen[a][:2] for a in theirs.agents]))
    actions = {"agent_1": np.array([0.5, -7.0]), "agent_0": np.array([0.25, 0.0])}
    after, rewards, _, truncated, _ = theirs.step(actions)
    for agent, acted in (("agent_0", [0.25, 0]), ("agent_1", [0.5, -1])):
        assert np.abs(after[agent][:2] - seen[agent][:2] - acted).max() < 0.5, "in its place, and clipped"
    total = float(np.sum([one[:2] for one in after.values()]))
    assert rewards == pytest.approx(dict.fromkeys(theirs.possible_agents, total), rel=1e-5)
    for _ in range(4):
        assert not truncated["agent_0"]
        *_, truncated, _ = theirs.step(dict.fromkeys(theirs.agents, np.zeros(2)))
    assert truncated == {"agent_0": True, "agent_1": True}, "at the latest after episode_length"
    assert theirs.agents == [] and theirs.step({}) == ({}, {}, {}, {}, {})
    first, _ = theirs.reset()
    second, _ = theirs.reset()
    assert not np.array_equal(first["agent_0"], second["agent_0"])


def test_local_rewards_by_name(suite):
    theirs = sc.pettingzoo_env(Farm(), rewards=("dog/run", "cat/run", "dog/bark"))
    theirs.reset(seed=0)
    assert theirs.action_space("cat_0").n == 3
    _, rewards, *_ = theirs.step({"dog_0": 3, "dog_1": np.int64(1), "cat_0": 2})
    assert rewards == {"dog_0": 33.0, "dog_1": 11.0, "cat_0": 200.0}
    alone = sc.pettingzoo_env(Farm(), rewards=("dog/bark",))
    alone.reset(seed=0)
    assert alone.step({"dog_0": 3, "dog_1": 1, "cat_0": 2})[1] == {"dog_0": 3.0, "dog_1": 1.0, "cat_0": 0.0}


def test_a_picture_shows_where_agents_are(suite):
    theirs = sc.pettingzoo_env(Meadow(), render_mode="rgb_array")
    theirs.reset(seed=1)
    first = theirs.render()
    theirs.step(dict.fromkeys(theirs.agents, np.ones(2)))
    second = theirs.render()
    assert first.shape == second.shape == (480, 480, 3) and first.dtype == np.uint8
    assert (first != 255).any() and not np.array_equal(first, second)
    assert sc.pettingzoo_env(Meadow()).render() is None


def test_what_is_wrong_is_said_in_a_line(suite):
    new, begun, farm = (sc.pettingzoo_env(kind()) for kind in (Meadow, Meadow, Farm))
    begun.reset(seed=0)
    farm.reset(seed=0)
    bad = np.zeros(3)
    for call, said in (
        (lambda: sc.pettingzoo_env(Farm(), render_mode="rgb_array"), r"needs scene\(state\), which farm"),
        (lambda: sc.pettingzoo_env(Meadow(), render_mode="human"), "render_mode = 'human'"),
        (lambda: sc.pettingzoo_env(Meadow(), rewards=("eest",)), "skill of meadow 'eest'; .* first: east"),
        (lambda: farm.state(), r"state\(\) needs central_state"),
        (lambda: begun.step({}), "no action for agent_0; give one for each of agent_0, agent_1"),
        (lambda: begun.step({"agent_0": bad}), r"agent_0 has the shape \(3,\); make it \(2,\)"),
        (lambda: farm.step({"dog_0": 4, "dog_1": 0, "cat_0": 0}), "dog_0 = 4: give an index from 0 to 3"),
        (lambda: new.state(), "meadow: call reset before state"),
        (lambda: sc.gymnasium_env(lone(Meadow)).step(bad), "meadow: call reset before step"),
        (lambda: sc.gymnasium_env(Meadow()), "meadow has 2 agents and Gymnasium knows one; use .*pettingzoo"),
    ):
        with pytest.raises(sc.UserError, match=said) as caught:
            call()
        assert "\n" not in str(caught.value)


@pytest.mark.filterwarnings("ignore:.*(too low|too high|alternative render modes):UserWarning")
def test_gymnasiums_own_check_passes():
    check = pytest.importorskip("gymnasium.utils.env_checker")
    env = sc.gymnasium_env(lone(Meadow), rewards=("east",), render_mode="rgb_array")
    check.check_env(env)
    env.reset(seed=2)
    after, reward, terminated, truncated, _ = env.step(np.array([0.5, 0.0], np.float32))
    assert reward == pytest.approx(after[0]) and not terminated and not truncated
    assert env.render().shape == (480, 480, 3)


def test_a_package_that_is_missing_is_named_with_what_brings_it(monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(
        sc.UserError, match=r"pettingzoo is not installed; `pip install 'skillcrew\[interop\]'`"
    ):
        sc.pettingzoo_env(Meadow())
    with pytest.raises(
        sc.UserError, match=r"gymnasium is not installed; `pip install 'skillcrew\[interop\]'`"
    ):
        sc.gymnasium_env(lone(Meadow))
