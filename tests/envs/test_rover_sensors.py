"""What a rover senses, in scenes small enough to work out by hand (thesis, equations 4.1 and 4.2)."""

import math

import numpy as np
import pytest

from oracles import rover
from oracles.rover_cases import NEVER
from oracles.rover_scene import AHEAD, FAR, STAND, Scene, around

HERE = (10.0, 10.0)
LONE = Scene(n_poi_types=2, poi_values=(3.0, 5.0))
TRIO = Scene(n_agents=3, n_poi_types=2, poi_values=(3.0, 5.0))
OCCLUDED = Scene(n_agents=3, n_poi_types=1, pois_per_type=3, poi_values=(3.0,), sensor="closest")
SHORT = Scene(n_poi_types=2, poi_values=(3.0, 5.0), observation_radius=4.0)
VANISHING = Scene(n_poi_types=2, pois_per_type=2, poi_values=(3.0, 5.0), observed_pois="vanish")
PERSISTING = Scene(n_poi_types=2, pois_per_type=2, poi_values=(3.0, 5.0))
DRAWN = Scene(n_poi_types=3, pois_per_type=2, poi_values=(3.0, 5.0, 7.0), order="drawn")
FRAIL = Scene(n_agents=3, n_poi_types=1, breakdowns=2)
CALLED = Scene(n_agents=2, n_poi_types=2, order="drawn")


@pytest.mark.parametrize("offset, sector", [((3, 0), 0), ((0, 3), 1), ((-3, 0), 2), ((0, -3), 3)])
def test_a_border_belongs_to_the_sector_that_it_begins(offset: tuple[int, int], sector: int) -> None:
    place = (HERE[0] + offset[0], HERE[1] + offset[1])
    cells = LONE.sensed(LONE.state(HERE, [place, FAR]))
    assert np.flatnonzero(cells[:, 1] > 1e-3).tolist() == [sector]


@pytest.mark.parametrize("heading", [-170, -60, 0, 25, 140])
@pytest.mark.parametrize(
    "bearing, sector", [(1, 0), (89, 0), (91, 1), (179, 1), (181, 2), (271, 3), (359, 3)]
)
def test_sectors_turn_counter_clockwise_from_the_heading(heading: int, bearing: int, sector: int) -> None:
    place = around(HERE, heading + bearing, 5.0)
    cells = LONE.sensed(LONE.state(HERE, [place, FAR], headings=[math.radians(heading)]))
    np.testing.assert_allclose(cells[:, 1], [3 / 25 if q == sector else 0 for q in range(4)], atol=1e-4)


def test_readings_are_sector_major_with_the_rovers_first() -> None:
    rovers = [HERE, around(HERE, 45, 4.0), around(HERE, 200, 2.0)]
    pois = [around(HERE, 100, 3.0), around(HERE, 300, 5.0)]
    _, step = TRIO.step(TRIO.state(rovers, pois))
    ahead, left, behind, right = [1 / 16, 0, 0], [0, 3 / 9, 0], [1 / 4, 0, 0], [0, 0, 5 / 25]
    np.testing.assert_allclose(step.observation[0], [*ahead, *left, *behind, *right], rtol=1e-5, atol=1e-6)


def test_the_readings_of_one_sector_add_up() -> None:
    cells = TRIO.sensed(TRIO.state([HERE, around(HERE, 30, 2.0), around(HERE, 60, 4.0)], [FAR, FAR]))
    np.testing.assert_allclose(cells[:, 0], [1 / 4 + 1 / 16, 0, 0, 0], rtol=1e-5)


def test_a_nearer_reflector_occludes_the_others_of_its_sector_and_channel() -> None:
    rovers = [HERE, around(HERE, 30, 2.0), around(HERE, 60, 4.0)]
    pois = [around(HERE, 50, 5.0), around(HERE, 20, 3.0), around(HERE, 100, 6.0)]
    cells = OCCLUDED.sensed(OCCLUDED.state(rovers, pois))
    expected = [[1 / 4, 3 / 9], [0, 3 / 36], [0, 0], [0, 0]]
    np.testing.assert_allclose(cells, expected, rtol=1e-5, atol=1e-6)


def test_rovers_sense_each_other_but_not_themselves() -> None:
    state = TRIO.state([HERE, around(HERE, 30, 2.0), around(HERE, 30, 6.0)], [FAR, FAR])
    totals = [TRIO.sensed(state, rover)[:, 0].sum() for rover in range(3)]
    np.testing.assert_allclose(totals, [1 / 4 + 1 / 36, 1 / 4 + 1 / 16, 1 / 16 + 1 / 36], rtol=1e-5)


def test_a_lone_rover_has_a_silent_channel_for_rovers() -> None:
    cells = LONE.sensed(LONE.state(HERE, [around(HERE, 10, 2.0), HERE]))
    assert cells.shape == (4, 3)
    assert not cells[:, 0].any()


def test_the_sensed_distance_is_bounded_below() -> None:
    cells = LONE.sensed(LONE.state(HERE, [around(HERE, 10, 0.25), around(HERE, 10, 1.25)]))
    np.testing.assert_allclose(cells[0], [0, 3, 5 / 1.25**2], rtol=1e-5)


@pytest.mark.parametrize("heading", [-2.0, 0.0, 1.0, 3.0])
def test_what_is_at_the_rovers_own_place_lies_in_the_first_sector(heading: float) -> None:
    state = TRIO.state([HERE, HERE, FAR], [HERE, FAR], headings=[heading] * 3)
    np.testing.assert_allclose(TRIO.sensed(state)[:, :2], [[1, 3], [0, 0], [0, 0], [0, 0]], atol=1e-5)


def test_nothing_is_sensed_beyond_the_radius_and_all_up_to_it() -> None:
    at, beyond = (HERE[0] + 4.0, HERE[1]), (HERE[0] + 4.01, HERE[1])
    np.testing.assert_allclose(SHORT.sensed(SHORT.state(HERE, [at, beyond]))[0], [0, 3 / 16, 0], rtol=1e-5)


def test_no_radius_is_no_limit() -> None:
    cells = LONE.sensed(LONE.state(HERE, [around(HERE, 10, 500.0), around(HERE, 10, 50.0)]))
    np.testing.assert_allclose(cells[0], [0, 3 / 500**2, 5 / 50**2], rtol=1e-4)


@pytest.mark.parametrize("scene, stays", [(VANISHING, False), (PERSISTING, True)])
def test_observed_pois_are_sensed_only_where_they_persist(scene: Scene, stays: bool) -> None:
    near, other = around(HERE, 40, 1.5), around(HERE, 40, 6.0)
    cells = scene.sensed(scene.state(HERE, [near, other, FAR, FAR]))
    np.testing.assert_allclose(cells[0, 1], 3 / 36 + (3 / 1.5**2 if stays else 0), rtol=1e-4)


def test_each_rover_senses_from_where_the_step_took_it() -> None:
    rovers = [HERE, around(HERE, 170, 3.0), around(HERE, 80, 7.0)]
    pois = [around(HERE, 20, 2.5), around(HERE, 250, 3.0)]
    state, step = TRIO.step(TRIO.state(rovers, pois, headings=[0.3, -1.0, 2.0]), (0.4, 0.2), AHEAD, STAND)
    np.testing.assert_allclose(
        step.observation, rover.observe(TRIO.world, TRIO.oracle_state(state)), rtol=1e-4, atol=1e-6
    )
    assert (np.abs(np.asarray(state.position)[:2] - rovers[:2]).max(1) > 0.3).all()


@pytest.mark.parametrize(
    "done, next_type", [("", 1), ("B", 2), ("C", 1), ("BC", 0), ("AB", 2), ("ABC", None)]
)
def test_the_next_type_calls_and_no_other(done: str, next_type: int | None) -> None:
    near, far = around(HERE, 20, 2.5), around(HERE, 100, 5.0)
    state = DRAWN.state(HERE, [near, far] * 3, observed=[name in done for name in "AABBCC"], order=[2, 0, 1])
    assert DRAWN.heard(state) == [float(kind == next_type) for kind in range(3)]
    np.testing.assert_allclose(DRAWN.sensed(state)[0, 1:], np.array([3.0, 5.0, 7.0]) / 2.5**2, rtol=1e-5)


def test_the_call_moves_on_in_the_step_in_which_a_type_is_observed() -> None:
    state = DRAWN.state(HERE, [HERE, FAR, HERE, FAR, HERE, FAR], order=[2, 0, 1])
    calls = []
    for _ in range(3):
        state, step = DRAWN.step(state)
        calls.append(np.asarray(step.observation[0, -3:]).tolist())
    assert calls == [[0, 0, 1], [1, 0, 0], [0, 0, 0]]


def test_every_rover_hears_the_call_and_without_a_drawn_order_there_is_none() -> None:
    _, step = CALLED.step(CALLED.state([HERE, HERE], [FAR, FAR], order=[1, 0]))
    assert np.asarray(step.observation)[:, -2:].tolist() == [[0, 1], [0, 1]]
    assert CALLED.env.observation_size == LONE.env.observation_size + 2


@pytest.mark.parametrize("time, others", [(3, [2, 2, 2]), (4, [1, 2, 1]), (8, [0, 1, 1])])
def test_a_broken_rover_is_not_sensed_and_goes_on_sensing(time: int, others: list[int]) -> None:
    """What is sensed after a step is who takes part in the next one."""
    rovers = [HERE, around(HERE, 30, 2.0), around(HERE, 90, 2.0)]
    state = FRAIL.state(rovers, [FAR], time=time, breaks_at=[NEVER, 5, 9])
    sensed = [FRAIL.sensed(state, rover)[:, 0].sum() for rover in range(3)]
    np.testing.assert_allclose(sensed, np.array(others) / 4, rtol=1e-5)
