"""Numbers to compare algorithms by, against exact fractions, SciPy and whole enumerations."""

import itertools
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy import stats

from skillcrew.analysis import comparison
from skillcrew.analysis.comparison import (
    area_under_curve,
    interquartile_interval,
    interquartile_mean,
    probability_of_improvement,
)
from skillcrew.intervals import proportion_interval, wilson

# Eighths and their sums are exact in floating point, so that a threshold is met exactly or not at all.
eighths = st.lists(st.integers(0, 8), min_size=1, max_size=12)


def array(*rows):
    return np.array(rows, float)


def few_resamples(call, *arguments):
    """For what does not look closely at the interval."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(comparison, "RESAMPLES", 20)
        return call(*arguments)


def test_a_curve_of_returns_begins_with_its_first_value():
    steps, values = np.array([10, 20, 40]), array(-4, -2, -2)
    # 10 steps at -4, 10 from there to -2, and 20 more.
    assert area_under_curve(steps, values, 40, start=None) == pytest.approx((-40 - 30 - 40) / 40)
    assert area_under_curve(steps, values, 40) == pytest.approx((-20 - 30 - 40) / 40)


# Area under a curve


@pytest.mark.parametrize(
    ("horizon", "expected"),
    [
        (5, (5 * 0.4 / 2) / 5),
        (10, (10 * 0.8 / 2) / 10),
        (15, (10 * 0.8 / 2 + 5 * (0.8 + 0.6) / 2) / 15),
        (20, (10 * 0.8 / 2 + 10 * (0.8 + 0.4) / 2) / 20),
        (50, (10 * 0.8 / 2 + 10 * (0.8 + 0.4) / 2 + 30 * 0.4) / 50),
    ],
)
def test_area_begins_at_zero_is_cut_at_the_horizon_and_keeps_the_last_value(horizon, expected):
    assert area_under_curve(np.array([10, 20]), array(0.8, 0.4), horizon) == pytest.approx(expected)


@given(st.lists(st.tuples(st.integers(1, 9), st.integers(0, 8)), min_size=1, max_size=8), st.integers(1, 90))
def test_area_against_exact_fractions(rows, horizon):
    steps = list(itertools.accumulate(pace for pace, _ in rows))
    values = [Fraction(value, 8) for _, value in rows]
    area = Fraction(0)
    known = [(0, Fraction(0)), *zip(steps, values, strict=True), (max(horizon, steps[-1]), values[-1])]
    for (start, low), (end, high) in itertools.pairwise(known):
        # Unit by unit: the paces are whole numbers, and so is the horizon.
        slope = (high - low) / (end - start) if end > start else Fraction(0)
        area += sum(low + slope * (unit - start + Fraction(1, 2)) for unit in range(start, min(end, horizon)))
    found = area_under_curve(np.array(steps), np.array([float(value) for value in values]), horizon)
    assert found == pytest.approx(float(area / horizon), abs=1e-12)


# The interquartile mean


@given(st.lists(st.integers(0, 100), min_size=1, max_size=40), st.randoms(use_true_random=False))
def test_the_interquartile_mean_is_scipys_trimmed_mean(scores, random):
    random.shuffle(scores)
    expected = stats.trim_mean(np.array(scores, float), 0.25)
    assert interquartile_mean(np.array(scores, float)) == pytest.approx(expected)


def test_the_interquartile_mean_is_over_all_tasks_together():
    scores = array([0, 0, 1], [0.5, 0.7, 0.9])
    assert interquartile_mean(scores) == pytest.approx((0 + 0.5 + 0.7 + 0.9) / 4)


def check_quantiles(interval, outcomes):
    """The ends of an interval cut off 2.5 % of equally likely outcomes on either side, but for chance."""
    outcomes, slack, tiny = np.array(outcomes), 0.006, 1e-9
    for end, below in ((interval.low, 0.025), (interval.high, 0.975)):
        assert (outcomes <= end + tiny).mean() >= below - slack
        assert (outcomes < end - tiny).mean() <= below + slack
    assert interval.low < interval.mean < interval.high


def test_the_interquartile_interval_against_all_resamples():
    scores = array([0.1, 0.15, 0.3], [0.6, 0.8, 0.95])
    draws = [list(itertools.product(task, repeat=3)) for task in scores]
    everything = [stats.trim_mean(np.ravel(drawn), 0.25) for drawn in itertools.product(*draws)]
    interval = interquartile_interval(scores)
    assert interval.mean == pytest.approx(stats.trim_mean(np.ravel(scores), 0.25))
    check_quantiles(interval, everything)


def test_resampling_never_mixes_tasks():
    # Seeds agree within each task and tasks differ: what is drawn within a task is always the same.
    scores = np.repeat(array([0.0], [0.1], [0.9], [1.0]), 5, axis=1)
    interval = few_resamples(interquartile_interval, scores)
    assert interval.low == interval.mean == interval.high == pytest.approx(0.5)


def test_equal_scores_leave_an_interval_without_width():
    interval = few_resamples(interquartile_interval, np.full((2, 3), 0.375))
    assert (interval.mean, interval.low, interval.high) == (0.375, 0.375, 0.375)


@given(st.integers(1, 3), st.integers(2, 6), st.integers(1, 1000))
def test_the_interquartile_interval_has_what_episodes_leave_open(tasks, seeds, episodes):
    alike = np.ones((tasks, seeds))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(comparison, "RESAMPLES", 20)
        interval = interquartile_interval(alike, episodes=episodes)
    middle = tasks * seeds - 2 * (tasks * seeds // 4)
    assert interval == proportion_interval(middle * episodes, middle * episodes)
    assert interval.low < 1.0


def test_intervals_are_reproducible_and_leave_other_random_numbers_alone():
    scores = np.random.default_rng(5).random((2, 5))
    before = str(np.random.get_state())
    first, again, other = (few_resamples(interquartile_interval, scores, seed) for seed in (0, 0, 1))
    assert first == again and first.low < first.mean < first.high
    assert str(np.random.get_state()) == before
    assert (first.low, first.high) != (other.low, other.high)


# The probability of improvement


def share_of_pairs(scores, others):
    points = []
    for mine, theirs in zip(scores, others, strict=True):
        pairs = [(one > other) + (one == other) / 2 for one in mine for other in theirs]
        points.append(sum(pairs) / len(pairs))
    return sum(points) / len(points)


def tied_scores(tasks, seeds):
    return arrays(float, (tasks, seeds), elements=st.integers(0, 3))


groups = st.tuples(st.integers(1, 3), st.integers(1, 5), st.integers(1, 5)).flatmap(
    lambda sizes: st.tuples(tied_scores(sizes[0], sizes[1]), tied_scores(sizes[0], sizes[2]))
)


@given(groups)
def test_the_probability_of_improvement_counts_pairs(pair):
    ours, theirs = pair
    forth = few_resamples(probability_of_improvement, ours, theirs).mean
    assert forth == pytest.approx(share_of_pairs(ours, theirs))
    assert forth + few_resamples(probability_of_improvement, theirs, ours).mean == pytest.approx(1)


@pytest.mark.parametrize(("ours", "expected"), [(0.9, 1.0), (0.5, 0.5), (0.1, 0.0)])
def test_always_never_and_ties(ours, expected):
    interval = few_resamples(probability_of_improvement, np.full((2, 3), ours), np.full((2, 4), 0.5))
    # Three pairs of seeds in two tasks: what six trials without exception, or ties, leave open.
    assert interval == wilson(expected, 6)
    assert interval.low < 0.65 or interval.high < 0.5


def test_tasks_are_compared_with_themselves_only():
    # On each task ours is ahead, though the other's scores on the easy task are the highest but ours.
    ours, theirs = array([0.2, 0.3], [0.9, 0.95]), array([0.1, 0.1, 0.0], [0.8, 0.7, 0.6])
    assert few_resamples(probability_of_improvement, ours, theirs).mean == 1
    assert few_resamples(probability_of_improvement, ours, theirs[::-1]).mean == 0.5


def test_the_interval_of_an_improvement_against_all_resamples():
    ours, theirs = array([0.2, 0.5, 0.9]), array([0.1, 0.5, 0.6, 0.8])
    # Both sides are drawn anew, independently.
    pairs = itertools.product(itertools.product(ours[0], repeat=3), itertools.product(theirs[0], repeat=4))
    everything = [share_of_pairs([one], [other]) for one, other in pairs]
    check_quantiles(probability_of_improvement(ours, theirs), everything)
