"""POIs that move, and rovers that no longer do."""

import math

import numpy as np
import pytest

from oracles.rover_cases import NEVER
from oracles.rover_scene import AHEAD, FAR, STAND, Scene

MOVING = Scene(n_agents=2, n_poi_types=2, poi_speed=1.5, breakdowns=1)
NOBODY = [FAR, FAR]


def drifting(place: tuple[float, float], course: float, steps: int) -> list[list[float]]:
    """Where a POI is after each of the next steps."""
    state = MOVING.state(NOBODY, [place, FAR], courses=[course, 0.0], breaks_at=[NEVER] * 2)
    places = []
    for _ in range(steps):
        state, _ = MOVING.step(state)
        places.append(state.poi_position[0].tolist())
    return places


def test_a_poi_goes_straight_on() -> None:
    expected = [(5 + 1.5 * n * math.cos(0.5), 6 + 1.5 * n * math.sin(0.5)) for n in (1, 2, 3)]
    np.testing.assert_allclose(drifting((5.0, 6.0), math.degrees(0.5), 3), expected, rtol=1e-5)


@pytest.mark.parametrize(
    "place, course, expected",
    [
        ((19.0, 4.0), 0, [(19.5, 4), (18, 4), (16.5, 4)]),
        ((1.0, 4.0), 180, [(0.5, 4), (2, 4), (3.5, 4)]),
        ((4.0, 19.0), 90, [(4, 19.5), (4, 18), (4, 16.5)]),
        ((4.0, 1.0), 270, [(4, 0.5), (4, 2), (4, 3.5)]),
    ],
)
def test_the_border_throws_a_poi_back(place: tuple, course: float, expected: list) -> None:
    np.testing.assert_allclose(drifting(place, course, 3), expected, rtol=1e-5)


def test_a_poi_thrown_back_keeps_its_course_along_the_border() -> None:
    side = 1.5 * math.sqrt(0.5)
    expected = [(20 - (side - 0.5), 4 + side), (20 - (2 * side - 0.5), 4 + 2 * side)]
    np.testing.assert_allclose(drifting((19.5, 4.0), 45, 2), expected, rtol=1e-5)


def test_where_a_poi_is_after_its_move_decides() -> None:
    """It comes within 2 m in the step, and is sensed and paid for from there."""
    state = MOVING.state([(5.0, 5.0)] * 2, [(8.0, 5.0), FAR], courses=[180, 0], breaks_at=[NEVER] * 2)
    state, step = MOVING.step(state)
    assert state.observed.tolist() == [True, False]
    assert MOVING.rewards(step, "go_to_poi_A") == [1.0, 1.0]
    np.testing.assert_allclose(step.observation[0, 1], 1 / 1.5**2, rtol=1e-5)


def test_a_broken_rover_neither_turns_nor_drives() -> None:
    state = MOVING.state(
        [(5.0, 5.0), (5.0, 9.0)], NOBODY, headings=[0.5, 0.5], courses=[0, 0], breaks_at=[NEVER, 1]
    )
    places, headings = [], []
    for _ in range(3):
        state, _ = MOVING.step(state, (0.1, 1.0), (0.1, 1.0))
        places.append(np.asarray(state.position))
        headings.append(np.asarray(state.heading))
    assert (places[1][1] == places[0][1]).all() and (places[2][1] == places[0][1]).all()
    assert headings[2][1] == headings[0][1] == pytest.approx(0.5 + 0.1 * math.pi)
    assert headings[2][0] == pytest.approx(0.5 + 0.3 * math.pi)
    assert math.dist(places[2][0], places[0][0]) > 1


def test_a_rover_that_breaks_down_at_once_never_moves() -> None:
    state = MOVING.state([(5.0, 5.0)] * 2, NOBODY, courses=[0, 0], breaks_at=[0, NEVER])
    state, _ = MOVING.step(state, AHEAD, STAND)
    assert state.position.tolist() == [[5.0, 5.0]] * 2
