"""Options of MADyS that cannot be meant, and the registry's names."""

import re
from typing import Any

import jax
import pytest

import skillcrew as sc
from oracles.refusals import refusal
from oracles.toy import Toy
from skillcrew.algorithms.madys import MADyS, MADySConfig
from skillcrew.algorithms.registry import ALGORITHMS, algorithm_class, make_algorithm
from skillcrew.envs.registry import make
from skillcrew.errors import UserError
from skillcrew.policies.selector import SelectorConfig

ENV = make("rover-t2-c1", episode_length=10)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("population", 0),
        ("population", 5),
        ("episodes", 0),
        ("probe_episodes", 0),
        ("probe_episodes", 11),
        ("updates", 0),
        ("updates", 7),
        ("buffer_capacity", -1),
        ("exploration_noise", -0.5),
        ("fitness_discount", 0.0),
        ("fitness_discount", 1.5),
    ],
)
def test_refuses_a_value_and_names_field_and_value(field: str, value: Any) -> None:
    assert f"{field} = {value}" in refusal(MADySConfig, **{field: value})
    with pytest.raises(UserError, match=re.escape(f"{field} = {value}")):
        MADyS(ENV, **{field: value})


def test_a_buffer_must_hold_a_generation() -> None:
    # 6 teams in 3 episodes, 4 skills in 2, of 10 steps of one rover each.
    sizes: dict[str, Any] = {"population": 6, "episodes": 3, "probe_episodes": 2}
    MADyS(ENV, buffer_capacity=260, **sizes)
    with pytest.raises(UserError, match=r"buffer_capacity = 259: .* 260 transitions"):
        MADyS(ENV, buffer_capacity=259, **sizes)


def test_a_buffer_grows_with_the_team_and_the_population() -> None:
    def holds(**fields: Any) -> int:
        shapes = jax.eval_shape(MADyS(ENV, **fields).init, jax.random.key(0))
        return shapes.skills.experience.experience.shape[1]

    assert holds() == 300_000, "as many as ever, where two generations fit"
    # 4000 teams in 5 episodes, 4 skills in 3, of 10 steps of one rover each.
    assert holds(population=4000) == 2 * 10 * (4000 * 5 + 4 * 3)
    assert holds(population=4000, buffer_capacity=200_120) == 200_120


def test_unknown_fields_and_skills_come_with_the_valid_ones() -> None:
    with pytest.raises(UserError, match="'populaton'; valid, nearest first: population,"):
        MADyS(ENV, populaton=60)
    with pytest.raises(UserError, match=r"'go_to_poi_C'; valid, nearest first: go_to_poi_[AB],"):
        MADyS(ENV, skills=("go_to_poi_A", "go_to_poi_C"))
    with pytest.raises(UserError, match="give at least one of go_to_poi_A, "):
        MADyS(ENV, skills=())


def test_overrides_replace_fields_of_the_configuration() -> None:
    madys = MADyS(ENV, MADySConfig(population=30, episodes=7), population=20)
    assert (madys.config.population, madys.config.episodes) == (20, 7)


def test_algorithms_are_found_by_name() -> None:
    assert algorithm_class("madys") is MADyS
    assert isinstance(make_algorithm("madys", ENV), MADyS)
    evolving = {"madys", "madys-plus", "madys-es", "open-loop", "mfl", "ea", "ccea", "merl", "erl", "cerl"}
    learning = {"td3", "ddpg", "dqn", "maddpg", "matd3", "ippo", "mappo", "coma", "liir"}
    assert set(ALGORITHMS) == evolving | learning
    kinds = {name: listed.load() for name, listed in ALGORITHMS.items()}
    assert all(kind.name == name for name, kind in kinds.items())
    assert len({kind.label for kind in kinds.values()}) == len(kinds), "legends must tell them apart"
    with pytest.raises(UserError, match="unknown algorithm 'madis'; valid, nearest first: madys"):
        algorithm_class("madis")


@pytest.mark.parametrize(("names", "expected"), [(None, "symlog"), ("sqrt", "sqrt"), ("none", "none")])
def test_the_environment_says_how_its_observations_are_scaled(names: str | None, expected: str) -> None:
    env = Toy()
    if names:
        env.input_scaling = names
    madys = MADyS(env).config
    assert madys.selector.input_scaling == madys.learner.network.input_scaling == expected
    assert make_algorithm("ea", env).config.actor.input_scaling == expected
    assert make_algorithm("merl", env).config.learner.network.input_scaling == expected
    assert sc.make("rover-t2-c1").input_scaling == "sqrt"


def test_a_network_may_say_otherwise_than_the_environment() -> None:
    madys = MADyS(Toy(), selector=SelectorConfig(input_scaling="none"))
    assert (madys.config.selector.input_scaling, madys.config.learner.network.input_scaling) == (
        "none",
        "symlog",
    )


@pytest.mark.parametrize("name", ["team", "D", "D++"])
def test_a_skill_does_not_learn_on_the_teams_reward(name):
    with pytest.raises(sc.UserError, match=r"a skill learns on a local reward, and .* is the team's"):
        sc.MADyS(sc.make("rover-t2-c2"), skills=("go_to_poi_A", name))
