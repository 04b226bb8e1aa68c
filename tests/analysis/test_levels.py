"""When a curve reaches a level and holds it: against exact fractions, and on synthetic curves of champions.

Synthetic champions are scored as those of a run are, on `RunConfig.score_episodes` episodes each generation.
"""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from skillcrew.analysis.levels import LEAST_ROWS, Reaching, Windows, reaching, restricted_mean, trailing_mean
from skillcrew.experiment.config import RunConfig

EPISODES = RunConfig().score_episodes

# Eighths and their sums are exact in floating point, so that a level is met exactly or not at all.
eighths = st.lists(st.integers(0, 8), min_size=1, max_size=30)


def by_hand(steps, values, level, windows, budget):
    """The definition, in whole numbers and fractions: values and the level are eighths."""

    def is_at_level(rows):
        return Fraction(sum(values[row] for row in rows), len(rows)) >= level

    for row, now in enumerate(steps):
        if not is_at_level([r for r in range(row + 1) if r == row or steps[r] > now - windows.trailing]):
            continue
        within = [r for r in range(row + 1, len(steps)) if steps[r] <= now + windows.following]
        following = max(within, list(range(row + 1, row + 1 + LEAST_ROWS)), key=len)
        if following[-1] >= len(steps) or now + windows.following > steps[-1]:
            return Reaching(now, False)
        if is_at_level(following):
            return Reaching(now, True)
    return Reaching(budget, False)


@given(eighths, st.integers(1, 8), st.integers(1, 40), st.integers(1, 200), st.integers(0, 2**32 - 1))
def test_a_level_is_reached_where_the_definition_says_so(values, level, trailing, following, seed):
    steps = np.cumsum(np.random.default_rng(seed).integers(1, 20, len(values))).tolist()
    windows, budget = Windows(trailing, following), steps[-1] + 5
    found = reaching(np.array(steps), np.array(values) / 8, level / 8, windows, budget)
    assert found == by_hand(steps, values, level, windows, budget)


def test_the_mean_looks_back_over_steps_and_not_over_rows():
    steps = np.array([10, 20, 30, 100, 105])
    means, rows = trailing_mean(steps, np.array([3.0, 0.0, 0.0, 6.0, 2.0]), 20)
    np.testing.assert_allclose(means, [3, 1.5, 0, 6, 4])
    assert rows.tolist() == [1, 2, 2, 1, 2]


def curve(*pieces):
    """Rows every 10 k steps, so many of each value."""
    values = np.concatenate([np.full(count, value) for value, count in pieces])
    return 10_000 * np.arange(1, len(values) + 1), values


def test_a_level_that_is_not_held_is_not_reached():
    windows = Windows.of(4e6)
    lucky = curve((0.0, 20), (1.0, 10), (0.0, 370))
    assert reaching(*lucky, 0.9, windows, 4e6) == Reaching(4e6, False)
    again = curve((0.0, 20), (1.0, 10), (0.0, 100), (1.0, 270))
    assert reaching(*again, 0.9, windows, 4e6) == Reaching(1.35e6, True)


def test_a_run_that_ends_too_soon_has_shown_nothing_and_bounds_the_steps():
    steps, values = curve((0.0, 350), (1.0, 50))
    windows = Windows.of(4e6)
    assert reaching(steps, values, 0.9, windows, 4e6) == Reaching(3.55e6, False)
    longer = curve((0.0, 350), (1.0, 56))
    assert reaching(*longer, 0.9, windows, 4.06e6) == Reaching(3.55e6, True)


def test_a_plateau_at_the_level_reaches_it_in_the_precision_of_metrics():
    # A run's metrics are recorded in single precision, where 90 of 100 episodes are a little below 0.9.
    steps, values = curve((np.float32(90 / 100), 400))
    assert reaching(steps, values.astype(np.float32), 0.9, Windows.of(4e6), 4e6) == Reaching(10_000, True)


def test_rows_without_a_value_are_passed_over():
    steps, values = curve((1.0, 400))
    values[::2] = math.nan
    assert reaching(steps, values, 0.9, Windows.of(4e6), 4e6) == Reaching(20_000, True)


@pytest.mark.parametrize(
    ("budget", "expected"), [(10e6, (50e3, 500e3)), (2e6, (50e3, 500e3)), (2e5, (5e3, 5e4))]
)
def test_windows_are_shares_of_small_budgets_and_the_same_for_large_ones(budget, expected):
    windows = Windows.of(budget)
    assert (windows.trailing, windows.following) == expected


def test_seeds_that_never_got_there_are_in_the_mean():
    some = [Reaching(1e6, True), Reaching(8e6, False), Reaching(3e6, True)]
    assert restricted_mean(some) == (4e6, 2)
    assert restricted_mean(some[::2]) == (2e6, 2)


# Luck and lag, by simulation


def runs(success, count=300, seed=0):
    """Curves of champions whose true success is given generation by generation."""
    success = np.asarray(success)
    return np.random.default_rng(seed).binomial(EPISODES, success, (count, len(success))) / EPISODES


def reached(generation, success, budget):
    """What seeds with such champions reached of 0.9."""
    steps = generation * np.arange(1, int(budget / generation) + 1)
    found = runs(success(steps))
    return [reaching(steps, values, 0.9, Windows.of(budget), budget) for values in found]


@pytest.mark.parametrize("budget", [1e6, 3e6, 10e6])
@pytest.mark.parametrize("generation", [10_000, 60_000, 100_000])
def test_a_plateau_of_086_is_not_called_09_by_luck(generation, budget):
    held = [one.held for one in reached(generation, lambda steps: np.full(len(steps), 0.86), budget)]
    assert np.mean(held) <= 0.02


def test_five_generations_that_look_back_alone_would_be_lucky():
    """What was wrong: a threshold that is passed once, over a window of generations."""
    values = runs(np.full(1000, 0.86))
    five = np.lib.stride_tricks.sliding_window_view(values, 5, axis=1).mean(-1)
    assert (five >= 0.9).any(1).mean() > 0.9


@pytest.mark.parametrize("generation", [10_000, 60_000])
@pytest.mark.parametrize("rise", [1.0, 0.3e6, 1e6])
def test_a_rise_to_095_is_dated_with_little_bias(generation, rise):
    """A line to 0.95 that passes 0.9 at 1 M steps; the shortest is a jump."""

    def success(steps):
        return np.clip(0.9 + (steps - 1e6) / rise * 0.95, 0, 0.95)

    found = reached(generation, success, 6e6)
    assert np.mean([one.held for one in found]) > 0.99
    assert abs(np.mean([one.steps for one in found]) - 1e6) < generation / 2 + 50e3
