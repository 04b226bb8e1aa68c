"""PettingZoo's worlds, beside PettingZoo itself."""

import sys
from types import ModuleType

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import skillcrew as sc

gymnasium = pytest.importorskip("gymnasium")
pettingzoo = pytest.importorskip("pettingzoo")
pytest.importorskip("mpe2")

from skillcrew.envs.bridges.pettingzoo_world import PettingZooWorld  # noqa: E402

SPREAD = "pettingzoo:mpe2.simple_spread_v3"


def test_a_team_sees_and_is_paid_what_pettingzoo_says():
    from mpe2 import simple_spread_v3

    arguments = {"N": 2, "max_cycles": 4, "continuous_actions": True}
    env = sc.make(SPREAD, arguments=arguments)
    assert (env.name, env.n_agents, env.observation_size, env.action_size) == ("simple_spread_v3", 2, 12, 5)
    assert (env.actions, env.episode_length, env.types) == ("continuous", 4, ())
    theirs = simple_spread_v3.parallel_env(**arguments)
    state, observation = jax.jit(env.reset)(jax.random.key(1))
    seen, _ = theirs.reset(seed=int(state["seed"]))
    np.testing.assert_array_equal(observation, np.stack([seen["agent_0"], seen["agent_1"]]))
    step_once, draw = jax.jit(env.step), np.random.default_rng(0)
    for time in range(4):
        action = draw.uniform(-1, 1, (2, 5)).astype(np.float32)
        state, step = step_once(state, jnp.asarray(action), jax.random.key(0))
        native = {f"agent_{index}": (action[index] + 1) / 2 for index in range(2)}
        seen, rewards, _, truncated, _ = theirs.step(native)
        np.testing.assert_allclose(step.observation, np.stack(list(seen.values())), rtol=1e-5)
        np.testing.assert_allclose(step.local_rewards[:, 0], list(rewards.values()), rtol=1e-5)
        np.testing.assert_allclose(step.team_reward, np.mean(list(rewards.values())), rtol=1e-5)
        assert bool(step.truncated) == truncated["agent_0"] == (time == 3)


def test_agents_that_see_differently_become_types():
    env = sc.make("pettingzoo:mpe2.simple_tag_v3", arguments={"num_adversaries": 2})
    reward = ("reward",)
    assert env.types == (sc.AgentType("adversary", 2, 14, 5, reward), sc.AgentType("agent", 1, 12, 5, reward))
    assert env.actions == "discrete"
    _, observation = env.reset(jax.random.key(0))
    assert {name: array.shape for name, array in observation.items()} == {
        "adversary": (2, 14),
        "agent": (1, 12),
    }


class Dropouts:
    """The first agent ends after 2 steps, by itself or cut off; the other after 3."""

    possible_agents = ["tall", "short"]  # noqa: RUF012
    unwrapped = ModuleType("no_limit_here")

    def __init__(self, cut=False, odd=False):
        self.cut, self.odd = cut, odd

    def observation_space(self, agent):
        return gymnasium.spaces.Box(-9, 9, (1,))

    def action_space(self, agent):
        bounded = gymnasium.spaces.Box(-1, 1, (1,))
        return gymnasium.spaces.Discrete(2) if self.odd and agent == "short" else bounded

    def reset(self, seed):
        self.agents, self.time = list(self.possible_agents), 0
        return {agent: np.zeros(1) for agent in self.agents}, {}

    def step(self, actions):
        assert list(actions) == self.agents, "only those that are there act"
        self.time += 1
        here, self.agents = self.agents, [a for a in self.agents if self.time < (2 if a == "tall" else 3)]
        gone = {agent: agent not in self.agents for agent in here}
        cut = {agent: gone[agent] and self.cut and agent == "tall" for agent in here}
        ended = {agent: gone[agent] and not cut[agent] for agent in here}
        seen = {agent: np.full(1, self.time) for agent in here}
        return seen, dict.fromkeys(here, float(self.time)), ended, cut, {}


@pytest.fixture
def dropouts(monkeypatch):
    module = ModuleType("dropouts")
    module.parallel_env = Dropouts
    monkeypatch.setitem(sys.modules, "dropouts", module)
    return module


@pytest.mark.parametrize("cut", [False, True])
def test_an_agent_that_is_gone_stays_as_it_was_and_is_paid_nothing(dropouts, cut):
    world = PettingZooWorld(dropouts, {"cut": cut})
    world.reset(0)
    moved = [world.step(np.zeros(2)) for _ in range(3)]
    assert [one.observation.tolist() for one in moved] == [[1, 1], [2, 2], [2, 3]]
    assert [one.rewards.tolist() for one in moved] == [[1, 1], [2, 2], [0, 3]]
    assert [(one.terminated, one.truncated) for one in moved] == [(False, False)] * 2 + [(not cut, cut)]
    world.reset(1)
    assert not world.step(np.zeros(2)).truncated, "a new episode"


def test_what_does_not_fit_is_said_in_a_line(dropouts):
    for name, options, said in (
        ("mpe2.simple_sprad_v3", {}, "is installed; nearest: mpe2.simple_spread_v3, "),
        ("mpe2", {}, "pettingzoo:mpe2 has no parallel_env"),
        ("mpe2.simple_spread_v3", {"arguments": {"M": 3}}, "cannot be made with M=3: TypeError"),
        ("no/path", {}, "module = 'no/path': give a module"),
        ("dropouts", {}, "episode_length: dropouts does not say when"),
        ("dropouts", {"arguments": {"odd": True}, "episode_length": 3}, "some agents act in Box"),
    ):  # fmt: skip
        with pytest.raises(sc.UserError, match=said) as caught:
            sc.make(f"pettingzoo:{name}", **options)
        assert "\n" not in str(caught.value)
