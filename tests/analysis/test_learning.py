"""Learning curves of metrics that are there, and of such that nobody can have written."""

import numpy as np
import pytest

import skillcrew as sc
from skillcrew.analysis.learning import within_budget
from skillcrew.experiment.score import RETURN


def columns(steps, dtype=np.int32):
    return {
        "seed": np.array([4] * len(steps) + [9]),
        "environment_steps": np.array([*steps, 1], dtype),
        RETURN.key: np.arange(len(steps) + 1.0),
    }


def test_rows_of_one_seed_up_to_its_budget():
    steps, values = within_budget(columns([10, 20, 31]), RETURN, 4, 30)
    assert (steps.tolist(), values.tolist()) == ([10, 20], [0, 1])
    assert len(within_budget(columns([]), RETURN, 4, 30)[0]) == 0


@pytest.mark.parametrize(("steps", "dtype"), [([10, 10], np.int32), ([20, 5], np.uint32)])
def test_steps_that_do_not_increase_are_damage(steps, dtype):
    with pytest.raises(sc.UserError, match=r"metrics\.parquet: damaged, environment steps of seed 4 do not"):
        within_budget(columns(steps, dtype), RETURN, 4, 30)
