"""Advantages and λ-returns against sums written from their definitions; episodes of unequal length."""

import jax.numpy as jnp
import numpy as np
import pytest

from oracles import on_policy as oracle
from skillcrew.learners.on_policy.returns import advantages, paid_apart, returns, share_paid, standardised


def of(function, seed: int, discount: float, trace: float, padding: float = oracle.PADDING) -> np.ndarray:
    experience = oracle.lived(seed, padding=padding)
    value = jnp.asarray(oracle.values(seed))
    ends = experience.terminated, experience.mask
    return np.asarray(function(experience.reward, value, *ends, discount, trace))


@pytest.mark.parametrize(("discount", "trace"), [(0.9, 0.7), (0.99, 1.0), (1.0, 0.95), (0.8, 0.0)])
def test_advantages_are_sums_of_temporal_differences(discount: float, trace: float) -> None:
    for seed in range(5):
        expected = oracle.advantages(oracle.lived(seed), oracle.values(seed), discount, trace)
        np.testing.assert_allclose(of(advantages, seed, discount, trace), expected, rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize(("discount", "trace"), [(0.9, 0.7), (0.99, 1.0), (1.0, 0.95), (0.8, 0.0)])
def test_returns_are_means_of_those_of_so_many_steps(discount: float, trace: float) -> None:
    counts = np.asarray(oracle.lived(0).mask)
    for seed in range(5):
        expected = oracle.lambda_returns(oracle.lived(seed), oracle.values(seed), discount, trace)
        found = of(returns, seed, discount, trace)
        np.testing.assert_allclose(found[counts], expected[counts], rtol=1e-4, atol=1e-5)


def test_what_stands_in_padding_is_not_looked_at() -> None:
    one, other = of(advantages, 1, 0.9, 0.8), of(advantages, 1, 0.9, 0.8, padding=float("nan"))
    np.testing.assert_array_equal(one, other)
    assert (one[~np.asarray(oracle.lived(1).mask)] == 0).all()


def test_standardised_advantages_have_mean_0_and_deviation_1_where_they_count() -> None:
    counts = oracle.lived(2).decides
    values = jnp.asarray(oracle.values(2)[:-1]) * 5 + 3
    found = np.asarray(standardised(values, counts))[np.asarray(counts)]
    np.testing.assert_allclose([found.mean(), found.std()], [0, 1], atol=1e-5)
    # Where all are alike, there is nothing to tell apart; where none counts, nothing is infinite.
    assert not standardised(jnp.full_like(values, 7.0), counts).any()
    assert jnp.isfinite(standardised(values, jnp.zeros_like(counts))).all()


def test_advantages_that_differ_by_more_than_what_was_paid_count_for_so_much_less() -> None:
    counts = oracle.lived(2).decides
    values = jnp.asarray(oracle.values(2)[:-1])
    deviation = np.asarray(values)[np.asarray(counts)].std()
    for apart in (0.0, 0.1, 0.4):
        share = share_paid(values, counts, jnp.array(apart))
        np.testing.assert_allclose(share, apart / deviation, atol=1e-5)
    assert share_paid(values, counts, jnp.array(2 * deviation)) == 1
    assert share_paid(jnp.zeros_like(values), counts, jnp.array(0.0)) < 1e-6


@pytest.mark.parametrize("discount", [1.0, 0.9])
def test_what_was_paid_is_of_rewards_alone(discount: float) -> None:
    """To the end of each episode, however it ended, where there was a choice."""
    for seed in range(3):
        experience = oracle.lived(seed)
        reward, counts = np.asarray(experience.reward), np.asarray(experience.decides)
        to_go = np.zeros_like(reward)
        for world, length in enumerate(oracle.LENGTHS):
            for t in range(length):
                weights = discount ** np.arange(length - t)
                to_go[t, world] = weights @ reward[t:length, world]
        found = paid_apart(experience.reward, experience.mask, experience.decides, discount)
        np.testing.assert_allclose(found, to_go[counts].std(), rtol=1e-4)
        nothing = jnp.zeros_like(experience.reward)
        assert paid_apart(nothing, experience.mask, experience.decides, discount) < 1e-6
