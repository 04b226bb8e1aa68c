"""Gymnasium's worlds, beside Gymnasium itself."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import skillcrew as sc

gymnasium = pytest.importorskip("gymnasium")

from skillcrew.envs.bridges import gymnasium_spaces as spaces  # noqa: E402


def beside(name, actions, native, **arguments):
    """An environment's steps, and what Gymnasium says for the same seed and actions of its own."""
    env = sc.make(f"gymnasium:{name}", arguments=arguments)
    state, observation = jax.jit(env.reset)(jax.random.key(7))
    theirs = gymnasium.make(name, **arguments)
    np.testing.assert_allclose(observation[0], theirs.reset(seed=int(state["seed"]))[0], rtol=1e-6)
    step_once = jax.jit(env.step)
    for action in actions:
        state, step = step_once(state, action, jax.random.key(0))
        yield env, step, theirs.step(native(action))


def test_bounds_are_reached_by_actions_of_minus_1_and_1():
    actions = [jnp.array([[value]]) for value in (-1.0, 0.25, 1.0, 3.0)]
    for env, step, (seen, reward, *_) in beside(
        "Pendulum-v1", actions, lambda one: np.clip(2 * np.asarray(one[0]), -2, 2)
    ):
        assert (env.n_agents, env.observation_size, env.action_size) == (1, 3, 1)
        assert (env.actions, env.episode_length, env.skills) == ("continuous", 200, ("reward",))
        np.testing.assert_allclose(step.observation[0], seen, rtol=1e-5)
        np.testing.assert_allclose([step.team_reward, step.local_rewards[0, 0]], [reward] * 2, rtol=1e-5)


def test_indices_and_an_end_that_is_none_of_time():
    ended = []
    for env, step, (seen, reward, terminated, truncated, _) in beside(
        "CartPole-v1", [jnp.array([1])] * 12, lambda one: int(one[0])
    ):
        assert (env.actions, env.action_size, env.episode_length) == ("discrete", 2, 500)
        np.testing.assert_allclose(step.observation[0], seen, rtol=1e-5)
        assert (step.team_reward, step.terminated, step.truncated) == (reward, terminated, truncated)
        ended.append(terminated)
        if terminated:
            break
    assert ended[-1] and len(ended) > 5


def test_a_discrete_observation_is_a_one_at_its_place_and_arguments_are_passed_on():
    env = sc.make("gymnasium:FrozenLake-v1", arguments={"map_name": "8x8", "is_slippery": False})
    assert (env.observation_size, env.action_size, env.episode_length) == (64, 4, 100)
    _, observation = env.reset(jax.random.key(0))
    np.testing.assert_array_equal(observation[0], np.eye(64)[0])


def test_spaces_there_and_back():
    box = gymnasium.spaces.Box(np.array([[-1, 0]]), np.array([[3, 10]]), dtype=np.float32)
    np.testing.assert_allclose(spaces.native(box, np.array([0.5, -2.0])), [[2.0, 0.0]])
    assert spaces.native(gymnasium.spaces.Discrete(3, start=5), np.array([2])) == 7
    np.testing.assert_array_equal(spaces.flat(gymnasium.spaces.Discrete(3, start=5), 6), [0, 1, 0])
    np.testing.assert_array_equal(spaces.flat(box, np.array([[1, 2]])), [1, 2])


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("Pendulm-v1", "gymnasium:Pendulm-v1: Gymnasium knows no Pendulm-v1; nearest: Pendulum-v1"),
        ("Blackjack-v1", r"agent observes Tuple\(.*\); only Box, which is flattened, and Discrete"),
        ("CliffWalking-v1", "episode_length: CliffWalking-v1 does not say when"),
        ("", "id = '': give what gymnasium.make is given"),
        ("nowhere_to_be:Pendulum-v1", "no module nowhere_to_be"),
    ],
)
def test_what_there_is_not_is_said_in_a_line(name, said):
    with pytest.raises(sc.UserError, match=said) as caught:
        sc.make(f"gymnasium:{name}")
    assert "\n" not in str(caught.value)


def test_arguments_that_it_does_not_take_are_named():
    with pytest.raises(sc.UserError, match=r"gymnasium:Pendulum-v1 cannot be made with weight=3: TypeError"):
        sc.make("gymnasium:Pendulum-v1", arguments={"weight": 3})


def test_actions_without_bounds_are_refused():
    seen = gymnasium.spaces.Box(-1, 1, (2,))
    for space, said in (
        (gymnasium.spaces.Box(-np.inf, 1, (2,)), r"has no bounds to scale \[-1, 1\] to"),
        (gymnasium.spaces.Box(0, 9, (2,), np.int64), "only Box of floats and Discrete can be acted in"),
        (gymnasium.spaces.MultiBinary(3), r"agent acts in MultiBinary\(3\)"),
    ):
        with pytest.raises(sc.UserError, match=said):
            spaces.agent("agent", seen, space)
