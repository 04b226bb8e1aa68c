"""The intervals against SciPy's formulas, textbook values and simulated coverage."""

import math

import numpy as np
import pytest
from scipy import stats

from skillcrew.analysis.statistics import mean_band, skill_shares
from skillcrew.errors import UserError
from skillcrew.intervals import proportion_interval, seed_interval


@pytest.mark.parametrize(
    ("successes", "trials"), [(0, 1), (1, 1), (0, 10), (10, 10), (1, 10), (37, 50), (981, 1000)]
)
def test_wilson_matches_scipy(successes, trials):
    expected = stats.binomtest(successes, trials).proportion_ci(0.95, method="wilson")
    interval = proportion_interval(successes, trials)
    assert interval.mean == successes / trials
    assert (interval.low, interval.high) == pytest.approx((expected.low, expected.high), abs=1e-12)
    assert 0 <= interval.low <= interval.mean <= interval.high <= 1


def test_wilson_has_width_and_exact_ends_at_the_borders():
    none, all_of_them = proportion_interval(0, 20), proportion_interval(20, 20)
    assert none.low == 0.0 and none.high == pytest.approx(0.16113, abs=1e-5)
    assert all_of_them.high == 1.0 and all_of_them.low == pytest.approx(1 - none.high)


@pytest.mark.parametrize("rate", [0.1, 0.5, 0.9])
def test_wilson_covers_the_true_rate_in_95_percent_of_experiments(rate):
    trials, experiments = 60, 20_000
    drawn = np.bincount(np.random.default_rng(0).binomial(trials, rate, experiments), minlength=trials + 1)
    ends = [proportion_interval(k, trials) for k in range(trials + 1)]
    covered = sum(n for n, end in zip(drawn, ends, strict=True) if end.low <= rate <= end.high) / experiments
    assert 0.935 < covered < 0.97


def test_proportions_that_make_no_sense_are_refused():
    with pytest.raises(UserError, match="at least 1 episode"):
        proportion_interval(0, 0)
    for successes in (-1, 11):
        with pytest.raises(ValueError, match=rf"0 to 10.*{successes}"):
            proportion_interval(successes, 10)


def test_seed_interval_by_hand():
    # Deviations ±0.2, ±0.1 and 0: a sum of squares of 0.1 over 4 degrees of freedom.
    interval = seed_interval(np.array([0.3, 0.4, 0.5, 0.6, 0.7]))
    half = 2.776445 * math.sqrt(0.1 / 4) / math.sqrt(5)
    assert (interval.mean, interval.low, interval.high) == pytest.approx(
        (0.5, 0.5 - half, 0.5 + half), abs=1e-6
    )


def test_seed_interval_matches_scipy_without_a_range():
    values = np.random.default_rng(1).normal(3, 2, 12)
    low, high = stats.t.interval(0.95, 11, loc=values.mean(), scale=stats.sem(values))
    interval = seed_interval(values, -math.inf, math.inf)
    assert (interval.low, interval.high) == pytest.approx((low, high))


def test_seed_interval_covers_the_true_mean_in_95_percent_of_experiments():
    draws = np.random.default_rng(2).normal(0.5, 0.02, (6000, 5))
    intervals = [seed_interval(row) for row in draws]
    covered = np.mean([interval.low <= 0.5 <= interval.high for interval in intervals])
    assert 0.94 < covered < 0.96


def test_seed_interval_is_clipped_to_its_range_only():
    values = np.array([0.0, 1.0, 1.0])
    assert (seed_interval(values).low, seed_interval(values).high) == (0.0, 1.0)
    narrower = seed_interval(values, lower=-0.25, upper=10.0)
    assert narrower.low == -0.25 and 1.0 < narrower.high < 10.0


def test_one_seed_has_a_mean_and_no_interval():
    interval = seed_interval(np.array([0.7]))
    assert interval.mean == 0.7 and math.isnan(interval.low) and math.isnan(interval.high)


def test_a_seed_without_a_value_is_not_left_out_unseen():
    assert math.isnan(seed_interval(np.array([0.5, np.nan, 0.6])).mean)
    with pytest.raises(ValueError, match="at least one seed"):
        seed_interval(np.array([]))


def test_band_of_lines_is_their_mean_line_over_the_steps_all_seeds_cover():
    steps = [np.array([0, 10, 40]), np.array([5, 7, 20, 31, 60]), np.array([2, 50])]
    slopes = np.array([0.002, 0.004, 0.009])
    band = mean_band(steps, [slope * x for slope, x in zip(slopes, steps, strict=True)], n_points=36)
    assert np.array_equal(band.steps, np.arange(5.0, 41.0))
    np.testing.assert_allclose(band.mean, slopes.mean() * band.steps)
    for point in (0, 17, 35):
        expected = seed_interval(slopes * band.steps[point])
        assert (band.low[point], band.high[point]) == pytest.approx((expected.low, expected.high))


def test_band_skips_rows_without_a_value():
    nan = np.nan
    steps = [np.array([0, 1, 2, 3, 4, 5]), np.array([1, 2, 3])]
    with_gaps = mean_band(
        steps, [np.array([nan, 0.0, nan, 0.5, nan, nan]), np.array([0.2, nan, 0.4])], n_points=3
    )
    assert np.array_equal(with_gaps.steps, [1.0, 2.0, 3.0])
    np.testing.assert_allclose(with_gaps.mean, [0.1, (0.25 + 0.3) / 2, 0.45])
    assert np.isfinite(with_gaps.low).all() and np.isfinite(with_gaps.high).all()


def test_band_of_one_seed_and_of_one_shared_step():
    alone = mean_band([np.array([0, 10])], [np.array([0.0, 1.0])], n_points=11)
    np.testing.assert_allclose(alone.mean, np.linspace(0, 1, 11))
    assert np.isnan(alone.low).all() and np.isnan(alone.high).all()
    single = mean_band([np.array([100]), np.array([100, 200])], [np.array([0.2]), np.array([0.4, 1.0])])
    assert np.array_equal(single.steps, [100.0]) and single.mean[0] == pytest.approx(0.3)


def test_smoothing_looks_back_only_and_skips_what_was_not_measured():
    steps = [np.arange(5)]
    jump = [np.array([0.0, np.nan, 0.0, 1.0, 1.0])]
    raw, smooth = (mean_band(steps, jump, n_points=5, window=window) for window in (0, 2))
    np.testing.assert_allclose(raw.mean, [0, 0, 0, 1, 1])
    np.testing.assert_allclose(smooth.mean, [0, 0, 0, 0.5, 1])


def test_a_band_of_seeds_that_agree_has_what_their_episodes_leave_open():
    steps, values = [np.array([0, 10, 20, 30])] * 3, [np.array([0.0, 0.0, 1.0, 1.0])] * 3
    assert (mean_band(steps, values, n_points=4).low == [0, 0, 1, 1]).all()
    raw, smooth = (mean_band(steps, values, n_points=4, window=w, episodes=20) for w in (0, 20))
    # Three seeds, and the rows that are averaged: of the last mean two.
    assert raw.low[-1] == pytest.approx(proportion_interval(60, 60).low)
    assert smooth.low[-1] == pytest.approx(proportion_interval(120, 120).low)
    assert raw.high[0] == pytest.approx(proportion_interval(0, 60).high)
    # In the middle of a rise seeds agree as well, and their episodes say more than they do.
    assert smooth.mean[2] == 0.5 and smooth.low[2] == pytest.approx(proportion_interval(60, 120).low)


def test_bands_that_cannot_be_made_are_refused():
    x, y = np.arange(3), np.zeros(3)
    with pytest.raises(UserError, match=r"seed 1.*no value"):
        mean_band([x, x], [y, np.full(3, np.nan)])
    with pytest.raises(UserError, match=r"share no range.*10.*2"):
        mean_band([x, x + 10], [y, y])
    for steps in (np.array([0, 2, 2]), np.array([0.0, np.nan, 2.0])):
        with pytest.raises(ValueError, match="strictly increase"):
            mean_band([steps], [y])
    with pytest.raises(ValueError, match="3 and 2"):
        mean_band([x], [np.zeros(2)])
    with pytest.raises(ValueError, match="at least 1 seed"):
        mean_band([], [])
    for wrong in ({"n_points": 1}, {"window": -1.0}, {"window": np.nan}):
        with pytest.raises(ValueError, match="at least 2, window 0"):
            mean_band([x], [y], **wrong)


def test_shares_match_a_count_and_sum_to_1_while_episodes_run():
    rng = np.random.default_rng(3)
    choices, ends = rng.integers(0, 4, (50, 9, 2)), rng.integers(1, 9, 50)
    choices[np.arange(9) >= ends[:, None]] = -1
    shares, running = skill_shares(choices, 4)
    assert running.tolist() == [sum(end > time for end in ends) for time in range(9)]
    for time in range(ends.max()):
        for agent in range(2):
            alive = [choices[episode, time, agent] for episode in range(50) if ends[episode] > time]
            counts = [alive.count(skill) for skill in range(4)]
            np.testing.assert_allclose(shares[time, agent], np.array(counts) / len(alive))
            assert shares[time, agent].sum() == pytest.approx(1)
    assert np.isnan(shares[ends.max() :]).all() and ends.max() < 9


def test_what_has_ended_is_never_counted():
    choices = np.full((4, 3, 1), -1)
    choices[:, 0] = [[0], [1], [1], [1]]
    choices[0, 1] = 2
    shares, running = skill_shares(choices, 3)
    np.testing.assert_allclose(shares[:2, 0], [[0.25, 0.75, 0], [0, 0, 1]])
    assert running.tolist() == [4, 1, 0]


def test_choices_that_cannot_be_shares_are_refused():
    for wrong in (4, -2):
        choices = np.array([[[0, 3], [wrong, 1]]])
        with pytest.raises(ValueError, match="must be -1 to 3"):
            skill_shares(choices, 4)
    with pytest.raises(ValueError, match="all agents at once"):
        skill_shares(np.array([[[0, 3], [-1, 1]]]), 4)
    with pytest.raises(UserError, match="no episodes"):
        skill_shares(np.full((3, 2, 1), -1), 4)


def test_a_logarithmic_grid_is_even_in_the_logarithm_and_on_the_same_curve():
    steps = np.arange(1, 401) * 1e5
    values = np.minimum(1, steps / 1e7)
    band = mean_band([steps, steps], [values, values / 2], n_points=50, logarithmic=True)
    assert (band.steps[0], band.steps[-1]) == (1e5, 4e7)
    np.testing.assert_allclose(band.steps[1:] / band.steps[:-1], 400 ** (1 / 49))
    np.testing.assert_allclose(band.mean, 0.75 * np.minimum(1, band.steps / 1e7))
    single = mean_band([steps[:1]], [values[:1]], logarithmic=True)
    assert list(single.steps) == [1e5]
