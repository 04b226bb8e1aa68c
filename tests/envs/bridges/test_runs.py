"""Runs in worlds of Gymnasium and PettingZoo: their folders, what is trusted, and the command line."""

import shutil
import sys

import pytest
import yaml

import skillcrew as sc
from cli.test_commands import call
from experiment import tiny
from skillcrew.cli.options import parse_options
from skillcrew.envs import registry
from skillcrew.envs.bridges.gymnasium_config import GymnasiumConfig
from skillcrew.envs.importing import import_object
from skillcrew.experiment.config import RunConfig, from_yaml, to_yaml

pytest.importorskip("gymnasium")

LAB = '''
"""A slider must be at the mark; it is paid 1, once."""

import gymnasium
import jax.numpy as jnp
import numpy as np


class Slide(gymnasium.Env):
    observation_space = gymnasium.spaces.Box(-9, 9, (1,))
    action_space = gymnasium.spaces.Box(-1, 1, (1,))

    def __init__(self, reach=0.2):
        self.reach = reach

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.place = self.np_random.uniform(-2, 2, 1).astype(np.float32)
        return self.place, {}

    def step(self, action):
        self.place = self.place + action
        there = bool(abs(self.place[0]) < self.reach)
        return self.place, float(there), there, False, {}


gymnasium.register("Slide-v0", Slide, max_episode_steps=6)


def near(observation, action, next_observation, reward):
    return -jnp.abs(next_observation[0])
'''
SLIDE = "gymnasium:slide_lab:Slide-v0"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [entry for entry in sys.path if entry])
    (tmp_path / "slide_lab.py").write_text(LAB)
    yield tmp_path
    import gymnasium

    sys.modules.pop("slide_lab", None)
    gymnasium.registry.pop("Slide-v0", None)


def test_trained_evaluated_and_resumed_to_the_same_bits(folder, capsys):
    env = sc.make(SLIDE, arguments={"reach": 0.5}, skills={"near": "slide_lab:near"})
    assert (env.name, env.skills, env.episode_length) == ("Slide-v0", ("near",), 6)
    algorithm = sc.EA(env, population=6, episodes=2, evolver="strategy")
    options = {"score_episodes": 3, "generations_per_report": 1, "checkpoint_seconds": 0.0, "keep": 9}
    sc.train(algorithm, 1, 90, folder / "run", **options)
    assert yaml.safe_load((folder / "run" / "config.yaml").read_text())["environment"] == {
        "name": "Slide-v0",
        "class": "skillcrew.envs.bridges.gymnasium_world:GymnasiumEnvironment",
        "arguments": {"reach": 0.5},
        "episode_length": None,
        "skills": {"near": "slide_lab:near"},
        "id": "slide_lab:Slide-v0",
    }
    assert call(["evaluate", "run"]) == 2
    line = capsys.readouterr().err
    assert line.count("\n") == 1 and "module slide_lab: code that neither" in line and "give --trust" in line
    whole = shutil.copytree(folder / "run", folder / "whole")
    again = sc.Run("run", trust=True, checkpoint=1).resume()
    assert again.metrics()["generation"].max() > 1
    tiny.assert_same_ending(folder / "run", whole, again.algorithm)


def saved(env, path):
    path.write_text(to_yaml(sc.make_algorithm("ea", env), RunConfig()))
    return path


def test_what_a_run_folder_may_name_without_trust(folder):
    pytest.importorskip("mpe2")
    arguments = {"N": 2, "continuous_actions": True, "local_ratio": 0.5}
    spread = sc.make("pettingzoo:mpe2.simple_spread_v3", arguments=arguments, episode_length=9)
    again = from_yaml(saved(spread, folder / "spread.yaml"))[0].env
    assert (again.describe(), again.episode_length) == (spread.describe(), 9)
    assert type(again.config.arguments["N"]) is int and again.config.arguments["continuous_actions"] is True
    pendulum = sc.make("gymnasium:Pendulum-v1", skills={"still": own_reward})
    with pytest.raises(sc.UserError, match=r"environment: skills.still = .*:own_reward: code that neither"):
        from_yaml(saved(pendulum, folder / "pendulum.yaml"))
    foreign = from_yaml(saved(sc.make(SLIDE), folder / "slide.yaml"), trust=True)[0].env
    assert foreign.name == "Slide-v0"
    with pytest.raises(sc.UserError, match="environment: module slide_lab: code that neither"):
        from_yaml(folder / "slide.yaml")


def own_reward(observation, action, next_observation, reward):
    return reward


def test_functions_given_from_python_are_found_again_where_they_can_be(folder):
    near = import_object("slide_lab:near")
    env = sc.make(SLIDE, skills={"near": near})
    path = saved(env, folder / "slide.yaml")
    assert from_yaml(path, trust=True)[0].env.skills == ("near",)
    path = saved(sc.make(SLIDE, skills={"own": lambda *given: given[3]}), path)
    with pytest.raises(
        sc.UserError, match=r"skills.own = .*<lambda>: cannot be imported from there; give the"
    ):
        from_yaml(path, trust=True)


def test_a_name_is_found_without_the_package_and_says_what_it_is():
    entry = registry.find("pettingzoo:nowhere.at_all_v1")
    assert (entry.name, entry.by_path, entry.is_foreign) == ("at_all_v1", False, True)
    assert not registry.find("pettingzoo:mpe2.simple_v3").is_foreign
    entry = registry.find("gymnasium:ALE/Pong-v5")
    assert (entry.name, entry.is_foreign) == ("ALE-Pong-v5", False)
    assert registry.find("gymnasium:lab:Slide-v0").is_foreign


def test_options_on_the_command_line_and_back():
    def parse(*words):
        return parse_options(GymnasiumConfig, list(words), GymnasiumConfig(), ("check",), "")

    config = parse("--arguments", "N=3,wind=0.5,loud=true,name=east,none_here=null")
    assert config.arguments == {"N": 3, "wind": 0.5, "loud": True, "name": "east", "none_here": None}
    assert parse("--arguments", "none", "--skills", "a=m:f,b=m.n:g").skills == {"a": "m:f", "b": "m.n:g"}
    for words, said in (
        (("--arguments", "N"), "'N' in arguments: write NAME=VALUE"),
        (("--arguments", "N=[1]"), r"'N=\[1\]' in arguments: give a number"),
        (("--skills", "near"), "'near' in skills: write NAME=VALUE"),
        (("--skills", "near=lab"), "skills.near = 'lab': give a function or an import path"),
        (("--episode-length", "0"), "episode_length = 0: give at least 1"),
    ):
        with pytest.raises(sc.UserError, match=said):
            parse(*words)


def test_list_says_that_they_are_there_and_slow(capsys):
    assert call(["list"]) == 0
    shown = capsys.readouterr().out
    for prefix in ("pettingzoo:NAME", "gymnasium:NAME"):
        (line,) = [line for line in shown.splitlines() if prefix in line]
        assert line.endswith("slow")
