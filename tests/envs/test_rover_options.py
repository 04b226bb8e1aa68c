"""Types at once, drawn orders, POIs that move, rovers that break: what a configuration makes of them."""

import functools
import math
from typing import Any

import pytest

from oracles import refusals
from skillcrew.envs.rover import config as rover_config

UnhookedConfig = refusals.unhooked(rover_config).RoverConfig
refusal = functools.partial(refusals.refusal, UnhookedConfig)
TWO_PAIRS = (("A", "B"), ("C", "D"))


@pytest.mark.parametrize(
    "n_types, groups, chain, in_order",
    [
        (4, TWO_PAIRS, ((), (), (0, 1), (0, 1)), ((0, 1), (2, 3))),
        (4, (("C", "D"), ("B", "A")), ((), (), (1, 0), (1, 0)), ((1, 0), (2, 3))),
        (5, (("D", "B"),), ((), (0,), (3, 1), (0,), (2,)), ((0,), (3, 1), (2,), (4,))),
        (2, (("A", "B"),), ((), ()), ((0, 1),)),
    ],
)
def test_the_chain_goes_from_group_to_group(n_types: int, groups: Any, chain: Any, in_order: Any) -> None:
    config = UnhookedConfig(n_agents=2, n_poi_types=n_types, simultaneous=groups)
    assert config.parent_indices == chain
    assert config.group_indices == in_order


def test_none_is_no_groups() -> None:
    assert UnhookedConfig(simultaneous=None) == UnhookedConfig()


def test_given_parents_stay_and_groups_come_in_an_order_in_which_they_can() -> None:
    config = UnhookedConfig(
        n_agents=2, n_poi_types=4, simultaneous=[["A", "D"]], parents={"A": ["C"], "B": ["D"]}
    )
    assert config.simultaneous == (("A", "D"),)
    assert config.parent_indices == ((2,), (3,), (), ())
    assert config.group_indices == ((2,), (0, 3), (1,))


@pytest.mark.parametrize(
    "groups, said",
    [
        ((("A", "E"),), "unknown POI type in simultaneous 'E'; valid, nearest first: "),
        ((("A", 1),), "unknown POI type in simultaneous '1'; valid, nearest first: "),
        ((("A", "B"), ("B", "C")), "B is named twice; give each type once at most"),
        ((("A", "A"),), "A is named twice; give each type once at most"),
        ((("A",),), "a group needs at least two types; leave out ('A',)"),
        (((),), "a group needs at least two types; leave out ()"),
        ("AB", "simultaneous = 'AB': give groups of types, such as (('A', 'B'), ('C', 'D'))"),
        (("A", "B"), "simultaneous = ('A', 'B'): give groups of types, such as"),
        (0, "simultaneous = 0: give groups of types"),
        ((3,), "simultaneous = (3,): give groups of types"),
        ((("A", "B", "C"),), "the largest group takes 6 rovers at once, above n_agents = 5"),
    ],
)
def test_groups_that_cannot_be_are_refused(groups: Any, said: str) -> None:
    assert said in refusal(n_agents=5, n_poi_types=4, spatial_coupling=2, simultaneous=groups)


@pytest.mark.parametrize(
    "groups, parents, waiting",
    [
        ((("A", "B"),), {"B": ("A",)}, "A, B"),
        ((("A", "B"),), {"C": ("A",), "B": ("C",)}, "A, B, C"),
        (TWO_PAIRS, {"C": ("A",), "B": ("D",)}, "A, B, C, D"),
    ],
)
def test_a_group_whose_types_wait_for_one_another_is_refused(groups: Any, parents: Any, waiting: str) -> None:
    message = refusal(n_agents=4, n_poi_types=4, simultaneous=groups, parents=parents)
    assert f"simultaneous = {groups}: {waiting} would wait for one another" in message
    assert f"parents = {parents}" in message


@pytest.mark.parametrize(
    "field, value", [("parents", {"B": ("A",)}), ("parents", {}), ("simultaneous", (("A", "B"),))]
)
def test_an_order_is_drawn_or_given(field: str, value: Any) -> None:
    message = refusal(n_agents=2, order="drawn", **{field: value})
    assert message == f"order = 'drawn': each episode draws its own chain; leave out {field}"


@pytest.mark.parametrize("value", [-0.1, 20.1, math.nan, math.inf, "1", True, None])
def test_pois_move_at_most_across_the_square(value: Any) -> None:
    assert refusal(poi_speed=value) == f"poi_speed = {value!r}: give a number from 0 to world_size = 20.0"
    assert UnhookedConfig(poi_speed=20).poi_speed == 20


@pytest.mark.parametrize("value", [-1, 1.0, True, "1", None])
def test_breakdowns_are_counted(value: Any) -> None:
    assert (
        refusal(n_agents=5, breakdowns=value) == f"breakdowns = {value!r}: give a whole number of at least 0"
    )


def test_as_many_rovers_are_left_as_are_needed_at_once() -> None:
    fields = dict(n_agents=7, n_poi_types=3, spatial_coupling=3)
    UnhookedConfig(**fields, breakdowns=4)
    assert refusal(**fields, breakdowns=5) == (
        "breakdowns = 5: no rover to spare, since 3 of n_agents = 7 are needed at once; give at most 4"
    )
    UnhookedConfig(**fields, simultaneous=(("A", "C"),), breakdowns=1)
    message = refusal(**fields, simultaneous=(("A", "C"),), breakdowns=2)
    assert "no rover to spare, since 6 of n_agents = 7 are needed at once; give at most 1" in message
