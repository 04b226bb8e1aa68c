"""Fitness averaged over a lineage, worked by hand."""

import jax.numpy as jnp
import numpy as np
import pytest

from skillcrew.evolution.lineage import Lineage


def assert_lineage(lineage: Lineage, mean, evaluations) -> None:
    np.testing.assert_allclose(lineage.mean, mean, rtol=1e-6)
    np.testing.assert_allclose(lineage.evaluations, evaluations, rtol=1e-6)


def test_first_evaluation_is_the_mean() -> None:
    assert_lineage(Lineage.create(3).add(jnp.array([0.2, 1.0, 0.0]), 10.0), [0.2, 1.0, 0.0], [1, 1, 1])


def test_means_are_plain_averages_until_memory_is_full() -> None:
    lineage = Lineage.create(2)
    for fitness in ([0.3, 1.0], [0.6, 0.0], [0.0, 0.5]):
        lineage = lineage.add(jnp.array(fitness), memory=3.0)
    assert_lineage(lineage, [0.3, 0.5], [3, 3])
    # Full: the new evaluation weighs a third, all that came before two thirds.
    assert_lineage(lineage.add(jnp.array([0.9, 0.2]), memory=3.0), [0.5, 0.4], [3, 3])


def test_memory_of_one_knows_the_last_evaluation_alone() -> None:
    lineage = Lineage(jnp.array([0.9]), jnp.array([7.0])).add(jnp.array([0.1]), memory=1.0)
    assert_lineage(lineage, [0.1], [1])


def test_child_starts_with_a_share_of_its_parents_evaluations() -> None:
    parents = Lineage(jnp.array([0.5, 0.8, 0.1]), jnp.array([4.0, 10.0, 1.0]))
    children = parents.pick(jnp.array([1, 1, 0], jnp.int32), jnp.array([0.2, 1.0, 0.5]))
    assert_lineage(children, [0.8, 0.8, 0.5], [2, 10, 2])
    # (0.8 · 2 + 0.2) / 3, (0.8 · 9 + 0.2) / 10 with one of the ten forgotten, (0.5 · 2 + 0.2) / 3
    assert_lineage(children.add(jnp.full(3, 0.2), memory=10.0), [0.6, 0.74, 0.4], [3, 10, 3])


def test_a_lucky_newborn_stands_below_an_elite_that_proved_itself() -> None:
    elite = Lineage(jnp.array([0.8]), jnp.array([5.0]))
    newborn = Lineage(jnp.array([0.5]), jnp.array([10.0])).pick(jnp.array([0], jnp.int32), 0.2)
    together = elite.concatenate(newborn).add(jnp.array([0.7, 1.0]), memory=10.0)
    assert_lineage(together, [4.7 / 6, 2 / 3], [6, 3])
    assert float(together.mean[0]) > float(together.mean[1])


def test_concatenation_keeps_the_order() -> None:
    one, other = Lineage(jnp.array([0.1]), jnp.array([1.0])), Lineage(jnp.array([0.2]), jnp.array([2.0]))
    assert_lineage(one.concatenate(other, one), [0.1, 0.2, 0.1], [1, 2, 1])


def test_unknown_individuals_have_no_evaluations() -> None:
    assert Lineage.create(4).evaluations.tolist() == [0, 0, 0, 0]
    assert Lineage.create(4).mean.shape == (4,)
    assert pytest.approx(0) == float(Lineage.create(4).evaluations.sum())


def test_who_lived_more_episodes_has_a_heavier_evaluation() -> None:
    lineage = Lineage(jnp.array([0.5, 0.5, 0.2]), jnp.array([4.0, 4.0, 0.0]))
    fitness, weights = jnp.array([0.8, 0.8, 0.6]), jnp.array([1.0, 5.0, 5.0])
    # (0.5 · 4 + 0.8) / 5, (0.5 · 4 + 0.8 · 5) / 9, and the evaluation alone.
    assert_lineage(lineage.add(fitness, 40.0, weights), [0.56, 6 / 9, 0.6], [5, 9, 5])
    # As many evaluations at once as one by one.
    one_by_one = lineage
    for _ in range(5):
        one_by_one = one_by_one.add(fitness, 40.0)
    assert float(one_by_one.mean[1]) == pytest.approx(6 / 9)


def test_a_heavy_evaluation_leaves_what_memory_has_room_for() -> None:
    lineage = Lineage(jnp.array([0.5]), jnp.array([4.0]))
    fitness, weight = jnp.array([0.8]), jnp.array([5.0])
    # One of the four is remembered: (0.5 + 0.8 · 5) / 6. Where not even the new one fits, it is all.
    assert_lineage(lineage.add(fitness, 6.0, weight), [0.75], [6])
    assert_lineage(lineage.add(fitness, 3.0, weight), [0.8], [5])
