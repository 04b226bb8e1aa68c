"""Single-point crossover."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import stats

from skillcrew.evolution.crossover import single_point

CHILDREN, GENES = 4000, 9


@pytest.fixture(scope="module")
def from_first() -> np.ndarray:
    """Which genes each child has of its first parent; every gene of every parent is its own number."""
    first = jnp.arange(float(CHILDREN * GENES)).reshape(CHILDREN, GENES)
    second = -1 - first
    child = np.asarray(single_point(jax.random.key(0), first, second))
    is_first = child == np.asarray(first)
    assert (is_first | (child == np.asarray(second))).all()
    return is_first


def test_child_is_a_prefix_of_the_first_and_a_suffix_of_the_second_parent(from_first: np.ndarray) -> None:
    assert (from_first == (np.arange(GENES) < from_first.sum(1, keepdims=True))).all()


def test_cut_leaves_genes_of_both_parents_and_is_uniform(from_first: np.ndarray) -> None:
    cuts = np.bincount(from_first.sum(1), minlength=GENES + 1)
    assert cuts[0] == cuts[GENES] == 0
    assert stats.chisquare(cuts[1:GENES]).pvalue > 1e-3


def test_a_single_gene_is_the_first_parents() -> None:
    assert single_point(jax.random.key(0), jnp.ones((3, 1)), jnp.zeros((3, 1))).tolist() == [[1.0]] * 3
