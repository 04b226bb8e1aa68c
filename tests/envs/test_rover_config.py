"""The presets, six of them the thesis's, and what is said of every value that makes no Rover Domain."""

import dataclasses
import functools
import json
import math
from typing import Any

import pytest

from oracles import refusals
from oracles.rover_cases import DEFAULTS
from skillcrew.envs.registry import make, names
from skillcrew.envs.rover import config as rover_config
from skillcrew.envs.rover.config import RoverConfig
from skillcrew.envs.rover.presets import PRESETS
from skillcrew.errors import UserError

# Thesis, section 4.4 and figures 4.2 and 4.3.
THESIS = {
    "rover-t2-c1": dict(n_agents=1, n_poi_types=2, spatial_coupling=1, episode_length=50),
    "rover-t2-c2": dict(n_agents=2, n_poi_types=2, spatial_coupling=2, episode_length=50),
    "rover-t2-c3": dict(n_agents=6, n_poi_types=2, spatial_coupling=3, episode_length=50),
    "rover-t3-c1": dict(n_agents=1, n_poi_types=3, spatial_coupling=1, episode_length=70),
    "rover-t3-c2": dict(n_agents=4, n_poi_types=3, spatial_coupling=2, episode_length=70),
    "rover-t3-c3": dict(n_agents=6, n_poi_types=3, spatial_coupling=3, episode_length=70),
}


def crew(scouts: int, haulers: int, scouts_at_poi: int) -> tuple[dict[str, Any], ...]:
    of_scouts = dict(coupling=scouts_at_poi, max_turn=math.pi, max_speed=1.5, observation_radius=None)
    of_haulers = dict(coupling=1, max_turn=1.5, max_speed=0.75, observation_radius=20.0)
    return (
        dict(name="scout", rovers=scouts, sensor_resolution=45, **of_scouts),
        dict(name="hauler", rovers=haulers, sensor_resolution=90, **of_haulers),
    )


TWO_PAIRS = (("A", "B"), ("C", "D"))
# Rovers, types, coupling, steps.
OWN: dict[str, tuple[Any, ...]] = {
    "rover-t1-c3": (6, 1, 3, 50),
    "rover-t4-c3": (6, 4, 3, 100),
    "rover-t5-c3": (6, 5, 3, 125),
    "rover-t6-c3": (6, 6, 3, 150),
    "rover-t3-c6": (12, 3, 6, 70),
    "rover-t3-c12": (24, 3, 12, 70),
    "rover-t2-c2-tight": (2, 2, 2, 20),
    "rover-t3-c3-tight": (6, 3, 3, 35),
    "rover-t4-c3-simultaneous": (6, 4, 3, 60, dict(simultaneous=TWO_PAIRS)),
    "rover-t3-c3-drawn": (6, 3, 3, 30, dict(order="drawn")),
    "rover-t2-c2-moving": (2, 2, 2, 25, dict(poi_speed=0.5)),
    "rover-t2-crew": (3, 2, 1, 50, dict(rover_types=crew(scouts=2, haulers=1, scouts_at_poi=1))),
    "rover-t3-crew": (6, 3, 1, 60, dict(rover_types=crew(scouts=4, haulers=2, scouts_at_poi=2))),
    "rover-t4-c3-breakdown": (7, 4, 3, 45, dict(simultaneous=TWO_PAIRS, breakdowns=1)),
    "rover-p4-c1-value": (6, 1, 1, 50, dict(pois_per_type=4, team_reward="value")),
    "rover-p4-c3-value": (6, 1, 3, 50, dict(pois_per_type=4, team_reward="value")),
    "rover-p4-c1-closest": (6, 1, 1, 50, dict(pois_per_type=4, team_reward="closest")),
    "rover-p4-c3-closest": (6, 1, 3, 50, dict(pois_per_type=4, team_reward="closest")),
}


UnhookedConfig = refusals.unhooked(rover_config).RoverConfig
refusal = functools.partial(refusals.refusal, UnhookedConfig)


def names_offered(message: str) -> list[str]:
    return message.split("nearest first: ")[1].split(", ")


def test_the_presets_are_those_of_the_thesis_and_our_own() -> None:
    assert set(PRESETS) == {*THESIS, *OWN}
    assert make("rover-t1-c3").skills[:2] == ("go_to_poi_A", "go_away_from_poi_A")


@pytest.mark.parametrize("name", OWN)
def test_a_preset_of_our_own_has_its_numbers(name: str) -> None:
    agents, types, coupling, steps, *more = OWN[name]
    numbers = dict(n_agents=agents, n_poi_types=types, spatial_coupling=coupling, episode_length=steps)
    options = more[0] if more else {}
    assert dataclasses.asdict(PRESETS[name]) == {**DEFAULTS, **numbers, **options}


@pytest.mark.parametrize("name", THESIS)
def test_a_preset_has_the_numbers_of_the_thesis(name: str) -> None:
    env = make(name)
    assert dataclasses.asdict(PRESETS[name]) == {**DEFAULTS, **THESIS[name]}
    assert env.config == PRESETS[name]
    assert env.name == name


def test_a_preset_makes_the_sizes_that_the_thesis_draws() -> None:
    env = make("rover-t3-c2")
    sizes = (env.n_agents, env.observation_size, env.action_size, env.episode_length, len(env.skills))
    assert sizes == (4, 4 * (1 + 3), 2, 70, 2 * (3 + 1))


def test_any_field_can_be_overridden_and_the_preset_stays() -> None:
    env = make("rover-t2-c2", n_agents=5, sensor_resolution=30)
    assert (env.n_agents, env.observation_size, env.config.spatial_coupling) == (5, 12 * 3, 2)
    assert PRESETS["rover-t2-c2"].n_agents == 2


def test_parents_default_to_the_chain() -> None:
    assert RoverConfig(n_poi_types=4).parent_indices == ((), (0,), (1,), (2,))
    assert RoverConfig(n_poi_types=3, parents={}).parent_indices == ((), (), ())


def test_numbers_and_lists_may_come_as_a_file_spells_them() -> None:
    config = UnhookedConfig(world_size=30, poi_values=[1, 2], parents={"A": ["B"]}, observation_radius=4)
    assert (config.values, config.parent_indices, config.world_size) == ((1.0, 2.0), ((1,), ()), 30)
    assert json.loads(json.dumps(dataclasses.asdict(config)))["parents"] == {"A": ["B"]}


def test_the_description_holds_every_field_and_builds_the_same_again() -> None:
    described = make("rover-t3-c1", parents={"C": ("A", "B")}, poi_values=(1.0, 2.0, 3.0)).describe()
    assert described.pop("name") == "rover-t3-c1"
    assert set(described) == set(DEFAULTS)
    assert RoverConfig(**described) == RoverConfig(
        **THESIS["rover-t3-c1"], parents={"C": ("A", "B")}, poi_values=(1.0, 2.0, 3.0)
    )


@pytest.mark.parametrize("given, nearest", [("rover-t2-c22", "rover-t2-c2"), ("Rover-T3-C3", "rover-t3-c3")])
def test_an_unknown_preset_is_refused_with_the_nearest_first(given: str, nearest: str) -> None:
    with pytest.raises(UserError, match=f"environment '{given}'") as caught:
        make(given)
    said, import_path, _ = str(caught.value).partition("; or an import path")
    assert names_offered(said)[0] == nearest and import_path
    assert set(names_offered(said)) == set(names())


@pytest.mark.parametrize(
    "given, nearest", [("n_agent", "n_agents"), ("sensor_resolutoin", "sensor_resolution")]
)
def test_an_unknown_field_is_refused_with_the_nearest_first(given: str, nearest: str) -> None:
    with pytest.raises(UserError, match=f"'{given}'") as caught:
        make("rover-t2-c1", **{given: 3})
    assert names_offered(str(caught.value))[0] == nearest
    assert set(names_offered(str(caught.value))) == set(DEFAULTS)


def test_an_override_is_checked_like_a_field() -> None:
    with pytest.raises(UserError, match=r"spatial_coupling = 3.*n_agents = 2"):
        make("rover-t2-c2", spatial_coupling=3)
    with pytest.raises(UserError, match=r"spatial_coupling = 2.*n_agents = 1"):
        make("rover-t2-c2", n_agents=1)


@pytest.mark.parametrize(
    "field", ["n_agents", "n_poi_types", "pois_per_type", "spatial_coupling", "episode_length"]
)
@pytest.mark.parametrize("value", [0, -3, 2.5, 2.0, True, "2", None, math.nan])
def test_counts_are_whole_and_positive(field: str, value: Any) -> None:
    message = refusal(**{field: value})
    assert f"{field} = {value!r}" in message
    assert "at least 1" in message


@pytest.mark.parametrize(
    "field",
    ("world_size", "max_turn", "max_speed", "activation_distance", "min_distance", "observation_radius"),
)
@pytest.mark.parametrize("value", [0.0, -1.0, math.inf, math.nan, "2", True])
def test_lengths_and_angles_are_positive_numbers(field: str, value: Any) -> None:
    message = refusal(**{field: value})
    assert f"{field} = {value!r}" in message
    assert "positive number" in message


@pytest.mark.parametrize("value", [0, -90, 7, 50, 720, 90.0, "90", True, None])
def test_the_resolution_divides_the_circle(value: Any) -> None:
    message = refusal(sensor_resolution=value)
    assert f"sensor_resolution = {value!r}" in message
    assert "360" in message


@pytest.mark.parametrize(
    "field, value, nearest",
    [
        ("sensor", "densty", "density"),
        ("sensor", "Closest", "closest"),
        ("order", "draw", "drawn"),
        ("order", ("A", "B"), None),
        ("observed_pois", "vanishes", "vanish"),
        ("team_reward", "fractions", "fraction"),
        ("team_reward", "values", "value"),
        ("team_reward", "close", "closest"),
        ("team_reward", None, None),
        ("sensor", ["closest"], None),
    ],
)
def test_a_choice_is_one_of_its_names(field: str, value: Any, nearest: str | None) -> None:
    message = refusal(**{field: value})
    assert field in message
    assert str(value) in message
    assert nearest is None or names_offered(message)[0] == nearest
    assert field != "team_reward" or set(names_offered(message)) == {"binary", "fraction", "value", "closest"}


def test_a_flag_is_true_or_false() -> None:
    assert "bounded = 'yes'" in refusal(bounded="yes")


@pytest.mark.parametrize(
    "values",
    [
        (),
        (1.0,),
        (1.0, 2.0, 3.0),
        (1.0, 0.0),
        (1.0, -2.0),
        (1.0, math.nan),
        (math.inf, 1.0),
        ("a", "b"),
        3.0,
        "12",
    ],
)
def test_poi_values_are_one_positive_number_per_type(values: Any) -> None:
    message = refusal(poi_values=values)
    assert "poi_values = " in message
    assert "2 positive numbers" in message


def test_there_are_as_many_types_as_letters() -> None:
    assert "n_poi_types = 27" in refusal(n_poi_types=27)
    assert UnhookedConfig(n_poi_types=26).type_names[-1] == "Z"


def test_a_coupling_above_the_rovers_is_refused_with_both_numbers() -> None:
    message = refusal(n_agents=3, spatial_coupling=4)
    assert "spatial_coupling = 4" in message
    assert "n_agents = 3" in message


@pytest.mark.parametrize(
    "parents, cycle",
    [
        ({"A": ("A",)}, "A"),
        ({"A": ("B",), "B": ("A",)}, "A, B"),
        ({"B": ("D",), "D": ("C",), "C": ("A", "B")}, "B, C, D"),
    ],
)
def test_a_cycle_of_parents_is_refused_by_name(parents: dict[str, tuple[str, ...]], cycle: str) -> None:
    message = refusal(n_poi_types=4, parents=parents)
    assert "parents = " in message
    assert f"cycle among {cycle};" in message


@pytest.mark.parametrize("parents", [{"B": ("E",)}, {"E": ("A",)}, {"B": ("a",)}, {1: ("A",)}])
def test_a_parent_that_is_no_type_is_refused_by_name(parents: dict[Any, tuple[str, ...]]) -> None:
    message = refusal(n_poi_types=3, parents=parents)
    wrong = next(str(n) for key, above in parents.items() for n in (key, *above) if n not in ("A", "B", "C"))
    assert "parents" in message
    assert f"'{wrong}'" in message
    assert set(names_offered(message)) == {"A", "B", "C"}


@pytest.mark.parametrize("parents", ["AB", [("B", "A")], {"B": None}, {"B": 3}, {"B": [["A"]]}])
def test_parents_of_the_wrong_kind_are_refused(parents: Any) -> None:
    assert "parents" in refusal(parents=parents)
