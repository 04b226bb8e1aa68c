"""What `check_environment` says of worlds in which one thing is wrong each."""

import json
import sys

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import skillcrew as sc
from cli.test_commands import call
from envs.stranger import write_package
from oracles.checking import AT_A_GLANCE
from oracles.mixed import Mixed, MixedDiscrete
from oracles.picking import Picking
from skillcrew.envs.checks import play


@pytest.fixture(autouse=True)
def speed_at_a_glance(monkeypatch):
    for name, value in AT_A_GLANCE.items():
        monkeypatch.setattr(play, name, value)


class Sound(sc.Environment):
    """Two agents on a line come to 0; they draw their starts, and gusts."""

    n_agents, observation_size, action_size, episode_length = 2, 3, 1, 4
    skills = ("approach", "flee")

    def reset(self, key):
        offset = jax.random.uniform(key, (2,), minval=-3.0, maxval=3.0)
        state = {"offset": offset, "time": jnp.zeros((), jnp.int32)}
        return state, self.observe(state)

    def step(self, state, action, key):
        gust = 0.01 * jax.random.normal(key, (2,))
        state = {"offset": state["offset"] + action[:, 0] + gust, "time": state["time"] + 1}
        near = jnp.abs(state["offset"])
        done = (near < 1.5).all()
        step = sc.TimeStep(
            observation=self.observe(state),
            local_rewards=jnp.stack([-near, near], axis=1),
            team_reward=done.astype(jnp.float32),
            terminated=done,
            truncated=(state["time"] >= self.episode_length) & ~done,
        )
        return state, step

    def observe(self, state):
        return jnp.stack([state["offset"], state["offset"][::-1], jnp.ones(2)], axis=1)


def altered(**fields):
    """A sound world whose time steps differ: each field as a function of the sound step and the state."""

    class Altered(Sound):
        def step(self, state, action, key):
            state, step = super().step(state, action, key)
            values = [change(step, state) for change in fields.values()]
            # Not by its constructor, whose types are checked under test, as they are not for a user.
            return state, eqx.tree_at(lambda step: [getattr(step, name) for name in fields], step, values)

    return Altered()


class NoAgents(Sound):
    n_agents = 0


class TwiceTheSkill(Sound):
    skills = ("approach", "approach")


class NamesInAList(Sound):
    skills = ["approach", "flee"]  # noqa: RUF012


class OddSuccess(Sound):
    success = "truncated"


class StateAlone(Sound):
    def reset(self, key):
        return super().reset(key)[0]


class NoTimeStep(Sound):
    def step(self, state, action, key):
        return super().step(state, action, key)[0], 1.0


class DecidesInPython(Sound):
    def step(self, state, action, key):
        if state["time"] > 2:
            action = -action
        return super().step(state, action, key)


class UsesNumPy(Sound):
    def observe(self, state):
        return jnp.asarray(np.stack([state["offset"], state["offset"], np.ones(2)], axis=1))


class TextInState(Sound):
    def reset(self, key):
        state, observation = super().reset(key)
        return {**state, "stage": "first"}, observation


class Misspelt(Sound):
    def step(self, state, action, key):
        return super().step({**state, "time": state["tmie"]}, action, key)


class StateOfOtherTypes(Sound):
    def step(self, state, action, key):
        state, step = super().step(state, action, key)
        return {**state, "time": state["time"].astype(jnp.float32)}, step


class StateOfOtherParts(Sound):
    def step(self, state, action, key):
        state, step = super().step(state, action, key)
        return {**state, "speed": jnp.zeros(2)}, step


class RemembersInPython(Sound):
    count = 0

    def reset(self, key):
        self.count += 1
        return super().reset(key)


class DrawsWithoutTheKey(Sound):
    def reset(self, key):
        state, observation = super().reset(key)
        return {**state, "offset": state["offset"] + np.random.default_rng().uniform()}, observation


class UsesTheKeyTwice(Sound):
    def reset(self, key):
        state, _ = super().reset(key)
        state["offset"] = state["offset"] + jax.random.normal(key, (2,))
        return state, self.observe(state)


class AlwaysTheSame(Sound):
    def reset(self, key):
        return super().reset(jax.random.key(0))


class OtherWorlds(Sound):
    def step_worlds(self, state, action, keys):
        state, step = super().step_worlds(state, action, keys)
        return {**state, "offset": 2 * state["offset"]}, step


WRONG = [
    (NoAgents(), "n_agents", "is 0; set it to a whole number of at least 1"),
    (TwiceTheSkill(), "skills", "give each once"),
    (NamesInAList(), "skills", "set it to a tuple of names"),
    (OddSuccess(), "success", """is 'truncated'; set it to "terminated", or to None"""),
    (StateAlone(), "reset", "return two things, (state, observation)"),
    (NoTimeStep(), "step", "return (state, skillcrew.TimeStep"),
    (DecidesInPython(), "step", "use jnp.where or jax.lax.cond"),
    (UsesNumPy(), "reset", "jax.numpy throughout"),
    (TextInState(), "reset", "keep arrays alone in the state"),
    (Misspelt(), "step", f"fails with KeyError: 'tmie' ({__file__}, line "),
    (StateOfOtherTypes(), "state", "state['time'] is int32[] after reset and float32[] after step"),
    (StateOfOtherParts(), "state", "other parts"),
    (RemembersInPython(), "purity", "self.count changes while playing; keep it in the state"),
    (DrawsWithoutTheKey(), "purity", "draw all from the key"),
    (UsesTheKeyTwice(), "keys", "reset draws from one key twice"),
    (OtherWorlds(), "step_worlds", "gives other results than step"),
    (altered(observation=lambda step, _: step.observation[0]), "step's observation", "make it (2, 3)"),
    (altered(local_rewards=lambda step, _: step.local_rewards[:, :1]), "step's local_rewards", "(2, 2)"),
    (altered(team_reward=lambda step, _: step.local_rewards[:, 0]), "step's team_reward", "single number"),
    (altered(team_reward=lambda step, _: step.terminated), "step's team_reward", "is of type bool"),
    (altered(terminated=lambda step, _: step.team_reward), "step's terminated", "make it bool"),
    (altered(truncated=lambda step, state: state["time"] >= 1), "endings", "both terminated and truncated"),
    (
        altered(team_reward=lambda step, state: 1.0 / (state["time"] - 3).astype(jnp.float32)),
        "team_reward",
        "not finite at step 3",
    ),
]


@pytest.mark.parametrize(
    ("env", "about", "said"), WRONG, ids=[f"{about}: {said[:30]}" for _, about, said in WRONG]
)
def test_what_is_wrong_is_said_with_how_to_mend_it(env, about, said):
    report = sc.check_environment(env)
    assert not report.ok
    wrong = [finding for finding in report.findings if finding.level == "wrong"]
    assert (wrong[0].about, said in wrong[0].said) == (about, True), str(report)
    assert "WRONG" in str(report)


@pytest.mark.parametrize(
    ("env", "about", "said"),
    [
        (AlwaysTheSame(), "reset", "two keys give the same world"),
        (
            altered(truncated=lambda step, _: step.truncated & False),
            "endings",
            "set truncated at the last one",
        ),
        (
            altered(local_rewards=lambda step, _: step.local_rewards * 0),
            "skills",
            "approach is always paid 0",
        ),
        (
            altered(local_rewards=lambda step, _: step.local_rewards[:, :1].repeat(2, 1)),
            "skills",
            "flee is paid what approach is paid",
        ),
    ],
)
def test_what_may_be_meant_is_noted(env, about, said):
    report = sc.check_environment(env)
    assert report.ok, str(report)
    notes = [finding for finding in report.findings if finding.level == "note"]
    assert any(note.about == about and said in note.said for note in notes), str(report)


def test_a_sound_world_gets_no_word_of_blame():
    report = sc.check_environment(Sound())
    assert report.ok and {finding.level for finding in report.findings} == {"fine"}
    said = {finding.about: finding.said for finding in report.findings}
    assert set(said) == {"sizes", "success", "shapes", "purity", "keys", "endings", "team reward", "speed"}
    assert "scored by their return" in said["success"]
    assert "2 agent(s), 3 numbers seen and 1 done by each, 4 steps; skills: approach, flee" in said["sizes"]
    ended, cut = (int(part.split()[0]) for part in said["endings"].split("actions ")[1].split(", "))
    assert ended + cut == 64 and ended > 0 and cut > 0


def test_success_that_is_defined_is_told():
    class Successful(Sound):
        success = "terminated"

    said = {finding.about: finding.said for finding in sc.check_environment(Successful()).findings}
    assert said["success"].startswith("is the share of episodes that end terminated")


def test_no_skills_is_no_mistake():
    class NoSkills(Sound):
        skills = ()

        def step(self, state, action, key):
            state, step = super().step(state, action, key)
            return state, eqx.tree_at(lambda step: step.local_rewards, step, jnp.zeros((2, 0)))

    report = sc.check_environment(NoSkills())
    assert report.ok and "none, which MADyS and MFL need" in str(report)


def test_the_command_says_the_same_and_its_exit_code_too(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(write_package(tmp_path))
    monkeypatch.setattr(sys, "path", list(sys.path))
    assert call(["check", "line_lab.worlds:LineWorld", "--environment.probes", "3"]) == 0
    shown = capsys.readouterr().out
    assert "3 agent(s)" in shown and shown.endswith("Nothing is wrong.\n")
    worlds = tmp_path / "line_lab" / "worlds.py"
    worlds.write_text(
        worlds.read_text().replace('"time": time}, step', '"time": time.astype(jnp.float32)}, step')
    )
    _forget_line_lab()
    assert call(["check", "line_lab.worlds:LineWorld", "--json"]) == 2
    printed = json.loads(capsys.readouterr().out)
    assert printed["ok"] is False
    assert [finding["about"] for finding in printed["findings"]] == ["sizes", "state"]
    _forget_line_lab()


def _forget_line_lab():
    for name in [name for name in sys.modules if name.partition(".")[0] == "line_lab"]:
        del sys.modules[name]


class Sizes(Mixed):
    n_agents = 4


class OneAction(Picking):
    action_size = 1


class ForgetsAType(Mixed):
    def reset(self, key):
        state, seen = super().reset(key)
        return state, {"scout": seen["scout"]}


class LongHaulers(Mixed):
    def reset(self, key):
        state, seen = super().reset(key)
        return state, {**seen, "hauler": jnp.ones((1, 6))}


class PlainTimeStep(Mixed):
    def step(self, state, action, key):
        state, step = super().step(state, action, key)
        blank = jnp.zeros((3, 5))
        return state, sc.TimeStep(blank, blank, step.team_reward, step.terminated, step.truncated)


class Offering(Sound):
    skill_texts = {"approach": "To 0.", "flee": "From 0."}  # noqa: RUF012
    observation_names = ("left", "right", "time")

    def central_state(self, state):
        return state["offset"]

    def scene(self, state):
        place = jnp.stack([state["offset"], jnp.zeros(2)], axis=1)
        return sc.Scene((-3.0, -1.0), (3.0, 1.0), (sc.Points("agents", place),))

    def counterfactual(self, state):
        return state["offset"]

    def counterfactual_step(self, state, other, action, key, copies):
        return other, jnp.zeros(())


class WideState(Offering):
    def central_state(self, state):
        return state["offset"][None]


class RewardForEach(Offering):
    def counterfactual_step(self, state, other, action, key, copies):
        return other, jnp.zeros(2)


class RewardAlone(Offering):
    def counterfactual_step(self, state, other, action, key, copies):
        return jnp.zeros(2)


class OtherState(Offering):
    def counterfactual_step(self, state, other, action, key, copies):
        return other[None], jnp.zeros(())


class NamesTwice(Offering):
    observation_names = ("left", "right", "left")


class NamesOneType(Mixed):
    observation_names = {"scout": ("a", "b", "c")}  # noqa: RUF012


class DrawsNothing(Offering):
    def scene(self, state):
        return state["offset"]


@pytest.mark.parametrize(
    ("env", "about", "said"),
    [
        (Sizes(), "n_agents", "is 4, and of the types 3; leave it out"),
        (OneAction(), "action_size", "leaves nothing to pick"),
        (ForgetsAType(), "reset's observation", "a dictionary of an array for each of ['scout', 'hauler']"),
        (LongHaulers(), "reset's observation['hauler']", "has the shape (1, 6); make it (1, 5)"),
        (PlainTimeStep(), "step", "skillcrew.TimeStepByType"),
        (WideState(), "central_state", "of the shape (1, 2); make it one row"),
        (RewardForEach(), "counterfactual_step", "of the shape (2,); pay the team one reward, a scalar"),
        (RewardAlone(), "counterfactual_step", "returns of the shape (2,); return what differs now and"),
        (OtherState(), "counterfactual_step", "unlike counterfactual's; keep its structure"),
        (DrawsNothing(), "scene", "return a skillcrew.Scene"),
        (NamesTwice(), "observation_names", "has 2 different names; give one for each of the 3 numbers"),
        (NamesOneType(), "observation_names", "has 0 different names of hauler; give one for each of the 5"),
    ],
)
def test_kinds_and_offers_are_looked_at_too(env, about, said):
    test_what_is_wrong_is_said_with_how_to_mend_it(env, about, said)


@pytest.mark.parametrize("kind", [Mixed, MixedDiscrete, Picking, Offering])
def test_sound_worlds_of_every_kind(kind):
    report = sc.check_environment(kind())
    # What is mixed begins alike in every world, and that is noted.
    blamed = [finding.about for finding in report.findings if finding.level != "fine"]
    assert blamed == (["reset"] if issubclass(kind, Mixed) else []), str(report)
    said = str(report)
    if kind is Mixed:
        assert "type hauler  1 agent(s), 5 numbers seen, 2 done by each; skills: lift, wait, drop" in said
    if kind is Picking:
        assert "each agent picks one of 4" in said
    if kind is Offering:
        assert "central_state, counterfactual_step, observation_names, scene, skill_texts" in said


def test_skills_without_a_text_are_noted():
    class Silent(Offering):
        skill_texts = {"approach": "To 0."}  # noqa: RUF012

    report = sc.check_environment(Silent())
    assert report.ok and "says nothing of flee" in str(report)
