"""A world on the host is a pure function of its seed and its actions, whatever JAX does with it."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import skillcrew as sc
from envs.bridges.walk import ALIKE, DIFFERENT, INDICES, WalkEnvironment, live
from skillcrew.envs.bridges.host_world import Agent, by_kind

WORLDS, LENGTH = 6, 7


def played(env, keys, actions):
    """[time, …, worlds] of a batch of worlds, in one compiled scan."""

    @jax.jit
    def play(keys, actions):
        state, observation = env.reset_worlds(keys)

        def step(state, action):
            state, moved = env.step_worlds(state, action, keys)
            return state, moved

        return state["seed"], observation, jax.lax.scan(step, state, actions)[1]

    return jax.tree.map(np.asarray, play(keys, actions))


@pytest.fixture(scope="module")
def episodes():
    env = WalkEnvironment()
    keys = jax.random.split(jax.random.key(0), WORLDS)
    actions = jax.random.uniform(jax.random.key(1), (LENGTH, 2, 2, WORLDS), minval=-1.0)
    return env, keys, actions, played(env, keys, actions)


def test_all_worlds_of_a_scan_are_what_a_python_loop_sees(episodes):
    env, _, actions, (seeds, observation, steps) = episodes
    assert (env.n_agents, env.observation_size, env.action_size, env.skills) == (2, 4, 2, ("reward",))
    lengths = set()
    for world, seed in enumerate(seeds):
        own = np.asarray(actions)[..., world].reshape(LENGTH, -1)
        seen, moved = live(ALIKE, int(seed), list(own))
        np.testing.assert_array_equal(observation[..., world].reshape(-1), seen[0])
        lengths.add(len(moved))
        for time in range(LENGTH):
            lived = time < len(moved)
            now = moved[min(time, len(moved) - 1)]
            paid = now.rewards if lived else np.zeros(2)
            np.testing.assert_array_equal(steps.observation[time, ..., world].reshape(-1), now.observation)
            np.testing.assert_array_equal(steps.local_rewards[time, :, 0, world], paid)
            np.testing.assert_allclose(steps.team_reward[time, world], paid.mean(), rtol=1e-6)
            assert steps.terminated[time, world] == (time >= len(moved) - 1)
    assert len(lengths) > 2, "episodes differ in length"
    assert not steps.truncated.any()


def test_the_same_keys_give_the_same_bits_in_a_batch_or_alone_and_in_any_order(episodes):
    env, keys, actions, (_, _, steps) = episodes
    again = played(env, keys, actions)[2]
    jax.tree.map(np.testing.assert_array_equal, steps, again)
    backwards = played(env, keys[::-1], actions[..., ::-1])[2]
    jax.tree.map(lambda one, other: np.testing.assert_array_equal(one, other[..., ::-1]), steps, backwards)


def test_states_can_be_forked_stepped_alone_and_in_any_order(episodes):
    env, keys, actions, (_, _, steps) = episodes
    step_worlds = jax.jit(env.step_worlds)
    states, _ = jax.jit(env.reset_worlds)(keys)
    after, _ = step_worlds(states, actions[0], keys)
    _, other = step_worlds(after, actions[3], keys)
    _, step = step_worlds(after, actions[1], keys)
    np.testing.assert_array_equal(step.observation, steps.observation[1])
    assert not np.array_equal(other.observation, step.observation)
    alone = jax.jit(env.step)
    two = {world: jax.tree.map(lambda leaf, world=world: leaf[..., world], states) for world in (4, 1)}
    for time in range(3):
        for world, state in two.items():
            two[world], step = alone(state, actions[time, ..., world], keys[0])
            np.testing.assert_array_equal(step.observation, steps.observation[time, ..., world])


def test_a_rollout_replays_nothing_and_nested_vmaps_are_one_call():
    env = WalkEnvironment(ends=False, max_steps=3)
    keys = jax.random.split(jax.random.key(2), (2, 3))

    def episode(key):
        state, _ = env.reset(key)
        return state, jax.lax.scan(lambda state, _: env.step(state, jnp.ones((2, 2)), key), state, None, 3)[1]

    state, steps = jax.jit(jax.vmap(jax.vmap(episode)))(keys)
    assert steps.observation.shape == (2, 3, 3, 2, 4)
    assert len(env.worlds) == env.resets == 6
    _, moved = live(ALIKE, int(state["seed"][1, 2]), [np.ones(4)] * 3, ends=False)
    np.testing.assert_array_equal(steps.observation[1, 2, 2].reshape(-1), moved[2].observation)


@pytest.mark.parametrize(("given", "own", "expected"), [(3, 7, 3), (None, 4, 4), (9, 4, 4)])
def test_episodes_are_cut_off_by_whoever_is_first(given, own, expected):
    env = WalkEnvironment(ends=False, max_steps=own, episode_length=given)
    assert env.episode_length == (given or own)
    state, _ = env.reset(jax.random.key(3))
    step_once = jax.jit(env.step)
    for time in range(expected + 1):
        state, step = step_once(state, jnp.zeros((2, 2)), jax.random.key(0))
        assert bool(step.truncated) == (time >= expected - 1)
        assert not step.terminated


def test_agents_that_differ_become_types_and_have_skills_of_their_own():
    skills = {
        "far": lambda seen, done, sees, reward: jnp.abs(sees[0]),
        "mouse/calm": lambda seen, done, sees, reward: reward - done.sum() + sees[0] - seen[0],
    }
    env = WalkEnvironment(DIFFERENT, skills=skills)
    assert env.types == (
        sc.AgentType("cat", 2, 3, 2, ("far",)),
        sc.AgentType("mouse", 1, 5, 1, ("far", "calm")),
    )
    key = jax.random.key(4)
    state, observation = jax.jit(env.reset)(key)
    action = {"mouse": jnp.full((1, 1), 0.5), "cat": jnp.arange(4.0).reshape(2, 2) / 4}
    _, step = jax.jit(env.step)(state, action, key)
    seen, moved = live(DIFFERENT, int(state["seed"]), [np.array([0, 0.25, 0.5, 0.75, 0.5], np.float32)])
    np.testing.assert_array_equal(observation["mouse"], seen[0][6:].reshape(1, 5))
    np.testing.assert_array_equal(step.observation["cat"], seen[1][:6].reshape(2, 3))
    np.testing.assert_allclose(step.local_rewards["cat"], np.abs(seen[1][[0, 3]])[:, None], rtol=1e-6)
    calm = moved[0].rewards[2] - 0.5 + seen[1][6] - seen[0][6]
    np.testing.assert_allclose(step.local_rewards["mouse"], [[abs(seen[1][6]), calm]], rtol=1e-5)
    np.testing.assert_allclose(step.team_reward, moved[0].rewards.mean(), rtol=1e-6)


def test_a_type_without_skills_of_its_own_is_paid_its_reward():
    env = WalkEnvironment(DIFFERENT, skills={"mouse/calm": lambda seen, done, sees, reward: -reward})
    assert env.skills == ("cat/reward", "mouse/calm")


def test_actions_by_index_reach_the_world_as_indices():
    env = WalkEnvironment(INDICES, skills={"pick": lambda seen, done, sees, reward: done.astype(float)})
    assert (env.actions, env.action_size, env.n_agents) == ("discrete", 4, 3)
    keys = jax.random.split(jax.random.key(5), 2)
    action = jnp.array([[3, 1], [0, 2], [1, 1]])
    state, _ = jax.jit(env.reset_worlds)(keys)
    _, step = jax.jit(env.step_worlds)(state, action, keys)
    for world in range(2):
        shown, _ = live(INDICES, int(state["seed"][world]), [np.asarray(action)[:, world]])
        np.testing.assert_array_equal(step.observation[..., world].reshape(-1), shown[1])
    np.testing.assert_array_equal(step.local_rewards[:, 0], action.astype(jnp.float32))


def test_what_does_not_fit_is_refused_in_a_line():
    mixed = (ALIKE[0], INDICES[0])
    for options, said in (
        ({"agents": mixed}, "some agents act in Box and some in Discrete"),
        ({"max_steps": None}, "episode_length: walk does not say when"),
        (
            {"skills": {"s": lambda seen, done, sees, reward: seen}},
            r"skills.s: returns .*4.*; return one number",
        ),
        ({"skills": {"s": lambda reward: reward}}, r"skills.s: fails with TypeError.*sees 4 numbers"),
        ({"skills": {"s": "math:pi"}}, "skills.s = math:pi: float, and no function"),
        ({"skills": {"s": "__main__:f"}}, "skills.s = __main__:f: cannot be imported from there"),
        ({"skills": {"s": 3}}, "skills.s = 3: give a function"),
        ({"skills": {"mice/s": lambda *_: 0.0}}, "unknown type of agents in skills 'mice'"),
    ):
        with pytest.raises(sc.UserError, match=said) as caught:
            WalkEnvironment(**options)
        assert "\n" not in str(caught.value)


def test_kinds_are_called_after_their_agents_where_that_tells_them_apart():
    def agent(name, size):
        return Agent(name, size, 1, "continuous")

    assert list(by_kind([agent("dog_0", 1), agent("cat_10", 2), agent("dog_1", 1)])) == ["dog", "cat"]
    assert list(by_kind([agent("a_0", 1), agent("a_1", 2)])) == ["a_0", "a_1"]
    assert list(by_kind([agent("a", 1), agent("b", 1), agent("b_2", 2)])) == ["a", "b_2"]
    assert list(by_kind([agent("0", 1), agent("team/1", 2)])) == ["0", "team-"]
