"""What intervals over seeds and of differences must be, whatever the numbers."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from skillcrew.intervals import difference_interval, proportion_interval, seed_interval

ROUNDING = 1e-12


@st.composite
def successes(draw):
    """How many of so many episodes each seed's champion solved; often all or none."""
    episodes = draw(st.integers(1, 50))
    wins = st.sampled_from([0, episodes]) | st.integers(0, episodes)
    count = draw(st.integers(2, 6))
    return np.array(draw(st.lists(wins, min_size=count, max_size=count))), episodes


@given(successes())
def test_an_interval_over_seeds_has_what_their_episodes_leave_open(drawn):
    wins, episodes = drawn
    interval = seed_interval(wins / episodes, episodes=episodes)
    assert 0 <= interval.low <= interval.mean <= interval.high <= 1
    assert interval.low < interval.high
    pooled = proportion_interval(int(wins.sum()), len(wins) * episodes)
    assert interval.low <= pooled.low + ROUNDING and interval.high >= pooled.high - ROUNDING
    over_seeds = seed_interval(wins / episodes)
    assert interval.mean == over_seeds.mean
    assert interval.low <= over_seeds.low and interval.high >= over_seeds.high


@given(successes(), st.integers(2, 4))
def test_more_seeds_that_do_the_same_narrow_it(drawn, times):
    wins, episodes = drawn
    few, many = (seed_interval(np.tile(wins, n) / episodes, episodes=episodes) for n in (1, times))
    assert many.low >= few.low - ROUNDING and many.high <= few.high + ROUNDING
    assert many.high - many.low < few.high - few.low or (few.low, few.high) == (0, 1)


def test_five_seeds_that_always_succeed():
    assert seed_interval(np.ones(5)).low == 1.0
    interval = seed_interval(np.ones(5), episodes=1000)
    # The rule of three says 3 of 5000; Wilson's two-sided interval reaches a little further.
    assert interval.high == 1.0 and 1 - 4 / 5000 < interval.low < 1 - 3 / 5000


def test_one_seed_alone_still_has_no_interval_over_seeds():
    assert math.isnan(seed_interval(np.ones(1), episodes=1000).low)


def test_an_interval_over_seeds_covers_where_champions_hardly_ever_fail():
    rng = np.random.default_rng(0)
    truth, episodes = 0.9998, 1000
    scores = rng.binomial(episodes, truth, (4000, 5)) / episodes
    covered = {}
    for known in (None, episodes):
        intervals = [seed_interval(row, episodes=known) for row in scores]
        covered[known] = np.mean([one.low <= truth <= one.high for one in intervals])
    assert covered[None] < 0.7 < 0.94 < covered[episodes]


# Differences


@given(successes(), successes())
def test_a_difference_is_within_its_interval_and_turns_round(one, other):
    episodes = min(one[1], other[1])
    ours, theirs = one[0] / one[1], other[0] / other[1]
    paired = len(ours) == len(theirs)
    forth = difference_interval(ours, theirs, paired, episodes)
    back = difference_interval(theirs, ours, paired, episodes)
    assert forth.mean == pytest.approx(ours.mean() - theirs.mean())
    assert -1 <= forth.low <= forth.mean <= forth.high <= 1 and forth.low < forth.high
    assert (forth.low, forth.high) == pytest.approx((-back.high, -back.low))


def test_differences_match_scipy():
    ours, theirs = np.random.default_rng(1).normal(size=(2, 6))
    for paired, test in (
        (True, stats.ttest_rel(ours, theirs)),
        (False, stats.ttest_ind(ours, theirs, equal_var=False)),
    ):
        expected, found = test.confidence_interval(), difference_interval(ours, theirs, paired)
        assert (found.low, found.high) == pytest.approx((expected.low, expected.high))


def test_pairs_tell_apart_what_intervals_that_overlap_do_not():
    ours = np.array([0.1, 0.3, 0.5, 0.7, 0.9])
    theirs = ours - np.array([0.04, 0.05, 0.06, 0.05, 0.05])
    assert seed_interval(ours).low < seed_interval(theirs).high
    assert difference_interval(ours, theirs, paired=True).low > 0
    assert difference_interval(ours, theirs, paired=False).low < 0


def test_a_difference_of_single_seeds_has_no_interval():
    for paired in (True, False):
        assert math.isnan(difference_interval(np.ones(1), np.zeros(1), paired, 10).low)
