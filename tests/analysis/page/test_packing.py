"""Numbers as text: what comes back, how fine it is, and that the page's own script would read it so."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays_of

from skillcrew.analysis.page.packing import (
    NOWHERE,
    STEPS_ACROSS,
    STEPS_AROUND,
    as_reading,
    as_turn,
    on_grid,
    pack,
    short,
    unpack,
)

SHAPES = arrays_of.array_shapes(min_dims=1, max_dims=3, max_side=5)


@given(st.lists(arrays_of.arrays(np.int16, SHAPES), max_size=3))
def test_what_is_packed_comes_back(arrays):
    named = {str(index): array for index, array in enumerate(arrays)}
    back = unpack(pack(named))
    assert list(back) == list(named)
    for name, array in named.items():
        np.testing.assert_array_equal(back[name], array)


def test_what_stays_the_same_costs_next_to_nothing():
    rng = np.random.default_rng(0)
    still = np.repeat(rng.integers(-3000, 3000, (20, 6, 1)), 100, axis=2)
    assert len(pack({"still": still})["data"]) < 900
    moving = rng.integers(-3000, 3000, (20, 6, 100))
    assert len(pack({"moving": moving})["data"]) > 15_000


def test_places_are_as_fine_as_a_screen():
    places = np.linspace(-30.0, 50.0, 1001)
    steps = on_grid(places, 0.0, 20.0)
    assert np.abs(steps / STEPS_ACROSS * 20.0 - places).max() <= 20.0 / STEPS_ACROSS / 2 + 1e-9
    assert on_grid(np.array([np.nan, np.inf, -np.inf]), 0.0, 1.0).tolist() == [NOWHERE, 32767, -32767]


def test_headings_are_directions():
    turns = as_turn(np.array([0.0, np.pi / 2, -np.pi / 2, 4 * np.pi, np.nan]))
    assert turns.tolist() == [0, STEPS_AROUND // 4, 3 * STEPS_AROUND // 4, 0, 0]


@pytest.mark.parametrize("value", [0.0, 0.05, -0.3, 2.0, -7.0, 8.0])
def test_readings_keep_their_sign_and_size(value):
    step = as_reading(np.array([value]), 8.0)[0]
    back = np.sign(step) * np.expm1(abs(step) / 100 * np.log1p(8.0))
    assert abs(back - value) <= 0.012 * (1 + abs(value))


def test_readings_that_are_no_numbers():
    assert as_reading(np.array([np.nan, np.inf, -np.inf]), 2.0).tolist() == [0, 100, -100]


def test_short_numbers():
    assert short(np.array([0.123456, 123456.0, 3.0, np.nan, np.inf])) == [0.1235, 123500, 3, None, None]
    assert short(np.array([123456]), 6) == [123456]
