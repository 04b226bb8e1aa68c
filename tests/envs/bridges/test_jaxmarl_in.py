"""JaxMARL's environments as ours, stepped beside JaxMARL itself."""

import sys

import jax
import jax.numpy as jnp
import numpy as np
import pytest

pytest.importorskip("jaxmarl")

import jaxmarl

import skillcrew as sc
from skillcrew.envs.bridges.jaxmarl_package import UNLIMITED, make_world, own_limit, without_limit
from skillcrew.experiment.config import RunConfig, from_yaml, to_yaml

SPREAD, SPEAKER = "jaxmarl:MPE_simple_spread_v3", "jaxmarl:MPE_simple_speaker_listener_v4"
RIDDLE, RIDDLE_STEPS = "jaxmarl:switch_riddle", 6
NOTHING, TELL = 0, 2
"""Actions of the riddle."""


DISCRETE = {"num_agents": 2, "num_landmarks": 3}
CONTINUOUS = {**DISCRETE, "action_type": "Continuous"}


def episode(env, actions, seed=0):
    """States and time steps of one world, after each of the actions."""

    @jax.jit
    def run(key):
        keys = jax.random.split(key, len(jax.tree.leaves(actions)[0]))
        state, observation = env.reset(keys[0])

        def advance(state, inputs):
            state, step = env.step(state, *inputs)
            return state, (state, step)

        return (state, observation), keys, jax.lax.scan(advance, state, (actions, keys))[1]

    return run(jax.random.key(seed))


def beside(world, start, keys, actions):
    """What JaxMARL itself says, step by step: (observations, rewards, done), with no reset."""
    state, said = start, []
    step = jax.jit(world.step_env)
    for key, action in zip(keys, actions, strict=True):
        observation, state, rewards, done, _ = step(key, state, action)
        said.append((observation, rewards, done["__all__"]))
    return said


def test_alike_agents_are_stepped_as_by_jaxmarl_until_time_is_up():
    env, length = sc.make(SPREAD, options=DISCRETE), 27
    assert (env.n_agents, env.observation_size, env.action_size) == (2, 14, 5)
    assert (env.actions, env.episode_length, env.skills, env.success) == (
        "discrete",
        25,
        ("own_reward",),
        None,
    )
    actions = jax.random.randint(jax.random.key(1), (length, 2), 0, 5)
    (state, observation), keys, (states, steps) = episode(env, actions)
    world = jaxmarl.make("MPE_simple_spread_v3", num_agents=2, num_landmarks=3)
    seen, _ = world.reset(keys[0])
    np.testing.assert_allclose(observation, [seen["agent_0"], seen["agent_1"]], rtol=1e-5)
    said = beside(world, state.world, keys, [{"agent_0": a[0], "agent_1": a[1]} for a in actions])
    for index, (observed, rewards, done) in enumerate(said):
        both = [rewards["agent_0"], rewards["agent_1"]]
        np.testing.assert_allclose(
            steps.observation[index], [observed["agent_0"], observed["agent_1"]], rtol=1e-4, atol=1e-5
        )
        np.testing.assert_allclose(steps.local_rewards[index, :, 0], both, rtol=1e-4)
        np.testing.assert_allclose(steps.team_reward[index], np.mean(both), rtol=1e-4)
        # JaxMARL's MPE ends a step after its own `max_steps`, and calls that done as well.
        assert bool(done) == (index + 1 > 25)
    assert not steps.terminated[:25].any()
    np.testing.assert_array_equal(steps.truncated[:25], np.arange(1, 26) == 25)
    # No reset after the end.
    np.testing.assert_array_equal(states.world.step, np.arange(1, length + 1))


def test_agents_that_differ_have_types():
    env = sc.make(SPEAKER, team_reward="first")
    assert env.types == (
        sc.AgentType("speaker", 1, 3, 3, ("own_reward",)),
        sc.AgentType("listener", 1, 11, 5, ("own_reward",)),
    )
    actions = {"speaker": jnp.array([[2], [0], [1]]), "listener": jnp.array([[4], [1], [0]])}
    (state, _), keys, (_, steps) = episode(env, actions)
    named = [{"speaker_0": jnp.array(a), "listener_0": jnp.array(b)} for a, b in ((2, 4), (0, 1), (1, 0))]
    for index, (observed, rewards, _) in enumerate(beside(env.world, state.world, keys, named)):
        for name in ("speaker", "listener"):
            np.testing.assert_allclose(steps.observation[name][index, 0], observed[f"{name}_0"], rtol=1e-5)
            np.testing.assert_allclose(
                steps.local_rewards[name][index, 0, 0], rewards[f"{name}_0"], rtol=1e-5
            )
        np.testing.assert_allclose(steps.team_reward[index], rewards["speaker_0"], rtol=1e-5)


def test_a_type_is_what_is_called_alike_and_as_large():
    # Alice and Bob see and do as much, and are no crew of one kind.
    assert [kind.name for kind in sc.make("jaxmarl:MPE_simple_crypto_v3").types] == ["eve", "alice", "bob"]
    tag = sc.make("jaxmarl:MPE_simple_tag_v3")
    assert [(kind.name, kind.agents) for kind in tag.types] == [("adversary", 3), ("agent", 1)]


@pytest.mark.parametrize(("kind", "expected"), [("mean", 2.5), ("sum", 10.0), ("first", 1.0)])
def test_the_teams_reward_is_made_of_the_agents(kind, expected):
    env = sc.make("jaxmarl:MPE_simple_tag_v3", team_reward=kind)
    own = dict(zip(env.world.agents, jnp.array([1.0, 2.0, 3.0, 4.0]), strict=True))
    assert float(env._team_reward(own)) == expected


def riddle(**config):
    return sc.make(RIDDLE, **config)


@pytest.mark.parametrize("length", [RIDDLE_STEPS, 4])
def test_a_task_that_is_over_is_told_from_time_that_is_up(length):
    """Also where both come at once: JaxMARL says `done` to either."""
    env = riddle(episode_length=length)
    assert (env.observation_size, env.action_size, env.n_agents) == (2, 3, 3)
    tell_at = jnp.array([length - 1, length - 2, length, 0])
    actions = jnp.where(jnp.arange(length) == tell_at[:, None], TELL, NOTHING)  # [worlds, time]
    actions = jnp.broadcast_to(actions.T[:, None], (length, 3, 4))

    @jax.jit
    def run(keys):
        def advance(state, action):
            state, step = env.step_worlds(state, action, keys)
            return state, (step.terminated, step.truncated)

        return jax.lax.scan(advance, env.reset_worlds(keys)[0], actions)[1]

    terminated, truncated = map(np.asarray, run(jax.random.split(jax.random.key(0), 4)))
    np.testing.assert_array_equal(terminated.T, np.arange(length) == np.asarray(tell_at)[:, None])
    np.testing.assert_array_equal(truncated[-1], ~terminated[-1])
    assert not truncated[:-1].any()


def test_a_limit_that_cannot_be_lifted_truncates():
    env = sc.make("jaxmarl:coin_game", options={"num_inner_steps": 2, "num_outer_steps": 3})
    assert (env.episode_length, env.n_agents, env.observation_size) == (6, 2, 36)
    yes, no = jnp.ones((), bool), jnp.zeros((), bool)
    assert not env._terminated(yes, yes, (None, None, None))
    assert env._terminated(yes, no, (None, None, None))


def test_a_limit_is_lifted_inside_a_wrapper_and_nowhere_else():
    world = make_world("HeuristicEnemySMAX", {"scenario": "3m"})
    assert (world.num_agents, own_limit(world)) == (3, 100)
    twin = without_limit(world)
    assert (own_limit(twin), own_limit(world)) == (UNLIMITED, 100)


def near(state, observation, action):
    """Of all agents: minus the distance to their nearest landmark."""
    offsets = state.p_pos[:2, None] - state.p_pos[None, 2:]
    return -jnp.linalg.norm(offsets, axis=-1).min(1)


def push(state, observation, action):
    return {agent: action[agent][1] + observation[agent][0] for agent in ("agent_1", "agent_0")}


def test_skills_see_what_jaxmarl_has_and_numbers_are_scaled_to_its_ranges():
    env = sc.make(SPREAD, options=CONTINUOUS, skills={"near": near, "push": push})
    assert (env.actions, env.skills) == ("continuous", ("near", "push"))
    actions = jax.random.uniform(jax.random.key(1), (2, 2, 5), minval=-1, maxval=1).at[0, 0].set(-1.0)
    (state, _), keys, (states, steps) = episode(env, actions)
    scaled = 0.5 + 0.5 * actions
    given = [{"agent_0": a[0], "agent_1": a[1]} for a in scaled]
    for index, (observed, _, _) in enumerate(beside(env.world, state.world, keys, given)):
        np.testing.assert_allclose(steps.observation[index, 1], observed["agent_1"], rtol=1e-4, atol=1e-5)
        place = np.asarray(states.world.p_pos[index])  # After the step.
        distance = np.sqrt(((place[:2, None] - place[None, 2:]) ** 2).sum(-1)).min(1)
        np.testing.assert_allclose(steps.local_rewards[index, :, 0], -distance, rtol=1e-5)
        pushed = scaled[index, :, 1] + steps.observation[index, :, 0]
        np.testing.assert_allclose(steps.local_rewards[index, :, 1], pushed, rtol=1e-4, atol=1e-5)


def test_a_skill_may_be_for_one_type():
    env = sc.make(
        SPEAKER,
        skills={
            "say": lambda state, observation, action: {"speaker_0": observation["speaker_0"].sum()},
            "rest": lambda state, observation, action: -jnp.abs(state.p_vel[:2]).sum(-1),
        },
    )
    assert env.skills == ("speaker/say", "speaker/rest", "listener/rest")
    step = jax.eval_shape(
        lambda key: env.step(
            env.reset(key)[0], {"speaker": jnp.zeros(1, int), "listener": jnp.zeros(1, int)}, key
        ),
        jax.random.key(0),
    )[1]
    assert {name: rewards.shape for name, rewards in step.local_rewards.items()} == {
        "speaker": (1, 2),
        "listener": (1, 1),
    }


def test_a_step_gives_back_the_types_that_it_takes():
    """JaxMARL counts the riddle's steps from Python's 0, which would be compiled for twice."""
    env = riddle()
    before = jax.eval_shape(env.reset, jax.random.key(0))[0]
    after = jax.eval_shape(env.step, before, jnp.zeros(3, int), jax.random.key(0))[0]
    assert before == after


def gives(value):
    return {"skills": {"go": lambda state, observation, action: value(state)}}


@pytest.mark.parametrize(
    ("name", "fields", "message"),
    [
        (
            SPREAD[:-3],
            {},
            r"unknown environment of JaxMARL .*spread'; .* first: MPE_simple_spread_v3",
        ),
        ("jaxmarl:ant_4x2", {}, r"cannot make ant_4x2: ImportError: .*brax"),
        ("jaxmarl:storm", {}, r"storm: its observations are no dictionary .* cannot be used"),
        ("jaxmarl:hanabi", {}, r"episode_length: hanabi has no time limit of its own; give one"),
        (SPREAD, {"episode_length": 26}, r"episode_length = 26: .* itself ends after 25 steps"),
        (SPREAD, {"episode_length": 0}, r"episode_length = 0: give at least 1"),
        (SPREAD, {"options": {"num_agent": 2}}, r"unknown option .* 'num_agent'; .* first: num_agents"),
        (SPREAD, {"options": {"num_agents": jnp.int32}}, r"options: num_agents is a .*cannot hold"),
        (
            "jaxmarl:coin_game",
            {"options": {"coins": 2}},
            r"cannot make coin_game .*unexpected .*'coins'",
        ),
        ("jaxmarl:overcooked", {"options": {"layout": "cramped"}}, r"unknown layout of overcooked 'cramped'"),
        (RIDDLE, {"reward": 1}, r"unknown field of jaxmarl-switch_riddle 'reward'; .* first: team_reward"),
        (RIDDLE, {"skills": {"go": "no_such:thing"}}, r"no_such:thing: no module no_such"),
        (RIDDLE, {"skills": {"go": "math:pi"}}, r"skills.go = math:pi: float, and no function"),
        (RIDDLE, gives(lambda state: state.has_been[:2]), r"skills: go gives the shape \(2,\); .* \(3,\)"),
        (RIDDLE, gives(lambda state: None), r"skills: go gives NoneType; .* \(3,\)"),
        (RIDDLE, gives(lambda state: state.place), r"skills: go.* fails with AttributeError: .*place"),
        (RIDDLE, gives(lambda state: {"agent_0": state.step}), r"no reward for agent_1; .* type agent"),
        (
            RIDDLE,
            gives(lambda state: {"agent_9": state.step}),
            r"unknown agent in what skill go.* 'agent_9'",
        ),
        (RIDDLE, gives(lambda state: {"agent_0": state.has_been}), r"agent_0 the shape \(3,\); give \(\)"),
    ],
)
def test_mistakes_are_told_in_one_line(name, fields, message):
    with pytest.raises(sc.UserError, match=message) as caught:
        sc.make(name, **fields)
    assert "\n" not in str(caught.value)


def test_where_jaxmarl_is_missing_the_line_says_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "jaxmarl", None)
    for call in (lambda: sc.make(SPREAD), lambda: sc.jaxmarl_env(sc.make("rover-t2-c1"))):
        with pytest.raises(sc.UserError, match=r"pip install 'skillcrew\[interop\]'"):
            call()


SKILLS_FILE = """
def rest(state, observation, action):
    return -abs(state.p_vel[:2]).sum(-1)
"""


@pytest.fixture
def config(tmp_path):
    path = tmp_path / "config.yaml"

    def write(env):
        path.write_text(to_yaml(sc.EA(env), RunConfig()))
        return path

    return write


def test_a_run_folder_makes_it_again(config):
    env = sc.make(SPREAD, options=CONTINUOUS, team_reward="sum")
    again, _ = from_yaml(config(env))
    assert again.env.name == env.name == "jaxmarl-MPE_simple_spread_v3"
    assert again.env.config == env.config
    assert again.env.config.episode_length == 25


def test_functions_are_imported_from_their_file_only_if_that_is_trusted(config, tmp_path, monkeypatch):
    (tmp_path / "lab_skills.py").write_text(SKILLS_FILE)
    monkeypatch.chdir(tmp_path)
    env = sc.make(SPREAD, options=DISCRETE, skills={"rest": "lab_skills.py:rest"})
    path = config(env)
    monkeypatch.chdir("/")
    with pytest.raises(
        sc.UserError, match=r"environment: skills.rest = .*lab_skills.py:rest: code .* --trust"
    ):
        from_yaml(path)
    again, _ = from_yaml(path, trust=True)
    assert again.env.skills == ("rest",)
    assert to_yaml(again, RunConfig()) == path.read_text()
    del sys.modules["lab_skills"]


def test_functions_without_a_name_need_the_environment_itself(config):
    rest = {"rest": lambda state, observation, action: -state.p_vel[:2, 0]}
    env = sc.make(SPREAD, options=DISCRETE, skills=rest)
    path = config(env)
    with pytest.raises(
        sc.UserError, match=r"skills.rest = .*<lambda>: cannot be imported .*Run\(folder, env\)"
    ):
        from_yaml(path, trust=True)
    again, _ = from_yaml(path, env)
    assert again.env is env
