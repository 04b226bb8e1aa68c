"""When a POI counts as observed: enough rovers at one time, and its parents at an earlier one."""

import math

import pytest

from oracles.rover_scene import AHEAD, FAR, STAND, Scene, around

A, B = (5.0, 5.0), (14.0, 5.0)
BACK = (1.0, 1.0)
"""The action that turns about and drives."""
PAIR = Scene(n_agents=2, n_poi_types=2, spatial_coupling=2)
LONE = Scene(n_poi_types=2, pois_per_type=2)
THREES = Scene(n_agents=4, n_poi_types=1, spatial_coupling=3)
C, D = (5.0, 14.0), (14.0, 14.0)
GROUPS = Scene(
    n_agents=5, n_poi_types=4, spatial_coupling=2, simultaneous=(("A", "B"), ("C", "D")), breakdowns=1
)
DRAWN = Scene(n_poi_types=3, order="drawn", team_reward="fraction")
FORK = Scene(n_poi_types=4, parents={"C": ("A", "B"), "D": ()})


def observed_by(scene: Scene, state, *actions) -> list[bool]:
    after, _ = scene.step(state, *actions)
    return after.observed.tolist()


@pytest.mark.parametrize("distance, seen", [(0.0, True), (2.0, True), (2.001, False)])
def test_a_rover_counts_up_to_the_activation_distance(distance: float, seen: bool) -> None:
    state = LONE.state((A[0] + distance, A[1]), [A, FAR, FAR, FAR])
    assert observed_by(LONE, state) == [seen, False, False, False]


@pytest.mark.parametrize("near, seen", [(0, False), (2, False), (3, True), (4, True)])
def test_coupling_takes_as_many_rovers_as_it_says(near: int, seen: bool) -> None:
    rovers = [around(A, 80 * i, 1.5) for i in range(near)] + [FAR] * (4 - near)
    assert observed_by(THREES, THREES.state(rovers, [A])) == [seen]


def test_the_place_after_the_move_counts() -> None:
    arriving = LONE.state(around(A, 180, 2.5), [A, FAR, FAR, FAR])
    leaving = LONE.state(around(A, 0, 1.5), [A, FAR, FAR, FAR])
    assert observed_by(LONE, arriving, AHEAD)[0]
    assert not observed_by(LONE, leaving, AHEAD)[0]


def test_rovers_that_come_one_after_another_do_not_observe_together() -> None:
    state = PAIR.state([around(A, 180, 1.5), around(A, 180, 2.5)], [A, FAR])
    # The first is near now and gone in the next step, in which the second arrives.
    state, _ = PAIR.step(state, STAND, STAND)
    state, _ = PAIR.step(state, BACK, AHEAD)
    assert state.observed.tolist() == [False, False]
    # It turns about once more: for the first time both are near at once.
    state, _ = PAIR.step(state, BACK, STAND)
    assert state.observed.tolist() == [True, False]


def test_a_parent_observed_in_the_same_step_does_not_count() -> None:
    state = LONE.state(A, [A, FAR, A, FAR])
    state, _ = LONE.step(state)
    assert state.observed.tolist() == [True, False, False, False]
    state, _ = LONE.step(state)
    assert state.observed.tolist() == [True, False, True, False]


def test_a_type_out_of_order_is_never_observed() -> None:
    state = LONE.state(B, [FAR, FAR, B, FAR])
    for _ in range(3):
        state, _ = LONE.step(state)
    assert not state.observed.any()


@pytest.mark.parametrize("first", [0, 1])
def test_any_poi_of_a_type_unlocks_the_next_type(first: int) -> None:
    state = LONE.state(B, [FAR, FAR, B, FAR], observed=[first == 0, first == 1, False, False])
    assert observed_by(LONE, state)[2]


@pytest.mark.parametrize(
    "done, seen",
    [("", "ABD"), ("A", "ABD"), ("B", "ABD"), ("D", "ABD"), ("AB", "ABCD"), ("ABD", "ABCD")],
)
def test_a_type_waits_for_all_of_its_parents_and_for_no_other_type(done: str, seen: str) -> None:
    state = FORK.state(A, [A, A, A, A], observed=[name in done for name in "ABCD"])
    assert observed_by(FORK, state) == [name in seen for name in "ABCD"]


def test_an_observed_poi_stays_observed() -> None:
    state = LONE.state(around(A, 0, 1.5), [A, FAR, FAR, FAR], headings=[0.1])
    state, _ = LONE.step(state)
    for _ in range(4):
        state, _ = LONE.step(state, AHEAD)
    assert math.dist(state.position[0].tolist(), A) > 5
    assert state.observed.tolist() == [True, False, False, False]


@pytest.mark.parametrize(
    "places, done, seen",
    [
        ((A, A, B, B, FAR), "", "AB"),
        ((A, A, A, B, FAR), "", ""),
        ((A, A, A, A, A), "", ""),
        ((C, C, D, D, FAR), "AB", "ABCD"),
        ((C, C, D, D, FAR), "", ""),
        ((C, C, FAR, FAR, FAR), "AB", "AB"),
        ((C, C, D, D, FAR), "A", "A"),
    ],
)
def test_a_group_is_observed_at_once_and_after_the_one_before(places: tuple, done: str, seen: str) -> None:
    state = GROUPS.state(places, [A, B, C, D], observed=[name in done for name in "ABCD"], breaks_at=[99] * 5)
    assert observed_by(GROUPS, state) == [name in seen for name in "ABCD"]


def test_types_of_a_group_met_one_after_the_other_do_not_count() -> None:
    state = GROUPS.state(
        [A, A, around(B, 0, 1.5), around(B, 180, 2.5), FAR], [A, B, C, D], breaks_at=[99] * 5
    )
    for actions in ([STAND] * 5, [STAND, AHEAD, STAND, STAND, STAND]):
        state, _ = GROUPS.step(state, *actions)
        assert not state.observed.any()
    # The second at A is 1 m away now and still counts; the fourth drives up to B.
    state, _ = GROUPS.step(state, STAND, STAND, STAND, AHEAD, STAND)
    assert state.observed.tolist() == [True, True, False, False]


@pytest.mark.parametrize("time, seen", [(6, True), (7, False), (8, False)])
def test_a_rover_does_not_count_from_its_breakdown_on(time: int, seen: bool) -> None:
    state = GROUPS.state([A, A, B, B, FAR], [A, B, C, D], time=time, breaks_at=[99, 99, 7, 99, 99])
    assert observed_by(GROUPS, state)[:2] == [seen, seen]


@pytest.mark.parametrize("order, steps", [((0, 1, 2), "ABC"), ((2, 0, 1), "BCA"), ((1, 2, 0), "CAB")])
def test_a_drawn_order_is_kept_to(order: tuple[int, ...], steps: str) -> None:
    state = DRAWN.state(A, [A, A, A], order=order)
    for count in (1, 2, 3):
        state, step = DRAWN.step(state)
        assert state.observed.tolist() == [name in steps[:count] for name in "ABC"]
        assert bool(step.terminated) == (count == 3)
    assert state.order.tolist() == list(order)
