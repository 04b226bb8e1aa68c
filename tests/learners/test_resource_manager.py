"""The resource manager of CERL, against the upper confidence bound written out, and on a bandit."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from oracles.refusals import refusal, unhooked
from skillcrew.learners import resource_manager
from skillcrew.learners.resource_manager import ResourceConfig, ResourceManager

LEARNERS, SLOTS = 3, 8
CONFIG = ResourceConfig()


def test_the_first_slots_go_round() -> None:
    manager = ResourceManager.create(LEARNERS, SLOTS)
    assert manager.allotted.tolist() == [0, 1, 2, 0, 1, 2, 0, 1]
    np.testing.assert_allclose(manager.probabilities(CONFIG), np.full(LEARNERS, 1 / LEARNERS), rtol=1e-6)


def test_values_are_recent_means_and_the_first_return_is_taken_whole() -> None:
    manager = ResourceManager.create(LEARNERS, SLOTS)
    returns = np.arange(1.0, SLOTS + 1)
    after = manager.observe(jax.random.key(0), jnp.asarray(returns, jnp.float32), CONFIG)
    expected = []
    for learner in range(LEARNERS):
        own = returns[learner::LEARNERS]
        value = own[0]
        for gained in own[1:]:
            value = CONFIG.memory * value + (1 - CONFIG.memory) * gained
        expected.append(value)
    np.testing.assert_allclose(after.value, expected, rtol=1e-6)
    assert after.visits.tolist() == [3, 3, 2]


def test_probabilities_are_shares_of_upper_confidence_bounds() -> None:
    value, visits = np.array([0.2, 0.9, 0.5], np.float32), np.array([40, 7, 13], np.int32)
    manager = ResourceManager(jnp.asarray(value), jnp.asarray(visits), jnp.zeros(SLOTS, jnp.int32))
    above = (value - value.min()) / ((value - value.min()).sum() + CONFIG.gap)
    bound = above + CONFIG.exploration * np.sqrt(np.log(visits.sum()) / visits)
    np.testing.assert_allclose(manager.probabilities(CONFIG), bound / bound.sum(), rtol=1e-5)


def test_the_budget_moves_to_the_better_learner_and_comes_back_when_it_is_no_longer() -> None:
    """And nobody is ever left without a chance."""

    def generation(carry, inputs):
        manager, (key, worth) = carry, inputs
        key_luck, key_next = jax.random.split(key)
        lucky = jax.random.uniform(key_luck, (SLOTS,)) < worth[manager.allotted]
        after = manager.observe(key_next, lucky.astype(jnp.float32), CONFIG)
        return after, manager.allotted

    worth = jnp.array([[0.1, 0.8, 0.1]] * 150 + [[0.9, 0.0, 0.1]] * 150)
    keys = jax.random.split(jax.random.key(1), 300)
    manager = ResourceManager.create(LEARNERS, SLOTS)
    _, allotted = jax.lax.scan(generation, manager, (keys, worth))
    share = np.array([(np.asarray(allotted) == learner).mean(1) for learner in range(LEARNERS)])
    assert share[1, 50:150].mean() > 0.5 > 2 * share[[0, 2], 50:150].mean(1).max()
    assert share[0, 200:].mean() > 0.5
    assert (share[:, 200:].mean(1) > 0.02).all()


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        ({"exploration": 0.0}, "resources.exploration = 0.0: give a positive number"),
        ({"memory": 1.0}, "resources.memory = 1.0: give a share from 0 to below 1"),
        ({"gap": 0.0}, "resources.gap = 0.0: give a positive number"),
    ],
)
def test_refuses_what_cannot_be_meant(fields: dict[str, Any], expected: str) -> None:
    assert refusal(unhooked(resource_manager).ResourceConfig, **fields).startswith(expected)
