"""Ranking and the two ways of drawing parents, against their closed forms."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import stats

from skillcrew.evolution.selection import proportional, rank, tournament

FITNESS = np.array([0.3, 0.9, 0.0, 0.5, 0.1, 0.7, 0.2], np.float32)
DRAWS = 20_000
CHANCE = 1e-3
"""Keys are fixed, so that a test either always passes or never does."""


def frequencies(winners) -> np.ndarray:
    return np.bincount(np.asarray(winners), minlength=FITNESS.size)


def test_ranks_the_fittest_first() -> None:
    assert rank(jnp.asarray(FITNESS)).tolist() == [1, 5, 3, 0, 6, 4, 2]


def test_equals_keep_their_order() -> None:
    assert rank(jnp.array([0.0, 1.0, 0.0, 1.0, 1.0])).tolist() == [1, 3, 4, 0, 2]


@pytest.mark.parametrize("size", [1, 3])
def test_tournament_winners_follow_the_closed_form(size: int) -> None:
    winners = tournament(jax.random.key(1), jnp.asarray(FITNESS), DRAWS, size)
    # The winner is worse than `better` individuals with probability ((n - better) / n) ** size,
    # and so is the worst one now and then: only a draw with replacement can fill a tournament with it.
    n = FITNESS.size
    worse_than = ((n - np.arange(n + 1)) / n) ** size
    expected = np.empty(n)
    expected[np.argsort(-FITNESS)] = worse_than[:-1] - worse_than[1:]
    assert stats.chisquare(frequencies(winners), DRAWS * expected).pvalue > CHANCE


def test_tournaments_are_independent() -> None:
    winners = np.asarray(tournament(jax.random.key(2), jnp.asarray(FITNESS), DRAWS, 2))
    pairs = np.zeros((FITNESS.size, FITNESS.size))
    np.add.at(pairs, (winners[:-1], winners[1:]), 1)
    assert stats.chi2_contingency(pairs).pvalue > CHANCE


def test_proportional_draws_are_proportional_to_fitness() -> None:
    drawn = frequencies(proportional(jax.random.key(3), jnp.asarray(FITNESS), DRAWS))
    positive = FITNESS > 0
    assert drawn[~positive].sum() == 0
    expected = DRAWS * (FITNESS / FITNESS.sum())[positive].astype(float)
    assert stats.chisquare(drawn[positive], expected / expected.sum() * DRAWS).pvalue > CHANCE


def test_proportional_draws_are_uniform_while_nobody_earned_anything() -> None:
    drawn = frequencies(proportional(jax.random.key(4), jnp.zeros(FITNESS.size), DRAWS))
    assert stats.chisquare(drawn).pvalue > CHANCE


@pytest.mark.parametrize("worst", [-1.5, -40.0])
def test_proportional_draws_count_from_the_worst_where_that_is_negative(worst: float) -> None:
    earned = np.array([2.0, 0.0, 1.0, 5.0, 0.0, 3.0, 1.0], np.float32)
    drawn = frequencies(proportional(jax.random.key(5), jnp.asarray(earned + worst, jnp.float32), DRAWS))
    assert drawn[earned == 0].sum() == 0
    expected = DRAWS * earned[earned > 0].astype(float) / earned.sum()
    assert stats.chisquare(drawn[earned > 0], expected).pvalue > CHANCE
    equal = frequencies(proportional(jax.random.key(6), jnp.full(earned.size, worst), DRAWS))
    assert stats.chisquare(equal).pvalue > CHANCE
