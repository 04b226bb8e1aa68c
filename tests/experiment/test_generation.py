"""The program of a run: the same one whether the run begins or goes on."""

import jax
import pytest

from experiment.tiny import SEEDS, tiny_cerl, tiny_ea, tiny_madys, tiny_merl, tiny_mfl
from skillcrew.experiment import generation
from skillcrew.experiment.config import RunConfig


@pytest.mark.parametrize("make", [tiny_madys, tiny_ea, tiny_mfl, tiny_merl, tiny_cerl])
def test_a_run_begins_with_the_types_that_a_checkpoint_gives_back(make):
    # A weak type, which no file keeps, would make a resumed run another program, compiled anew.
    begun = jax.tree.leaves(generation.shapes(make(), RunConfig(SEEDS, 100)))
    assert not any(leaf.weak_type for leaf in begun)
