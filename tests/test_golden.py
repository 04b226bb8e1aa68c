"""What the golden run says of other figures."""

import math

from benchmarks.golden import differences

GOLDEN = {"fitness": [0.0, 0.25, 0.5], "loss": [math.nan, 2.0, 3.0], "steps": [1.0, 2.0, 3.0], "gone": [1.0]}


def test_the_same_figures_do_not_differ_nan_among_them() -> None:
    assert differences(GOLDEN, dict(GOLDEN)) == []


def test_each_figure_says_where_it_first_differs_the_earliest_first() -> None:
    found = {
        "fitness": [0.0, 0.25, 0.75],
        "loss": [math.nan, 2.5, 9.0],
        "steps": [1.0, 2.0, 3.0],
        "new": [0.0],
    }
    first, second = differences(GOLDEN, found)
    assert (first.figure, first.row, first.golden, first.found) == ("loss", 1, 2.0, 2.5)
    assert (second.figure, second.row) == ("fitness", 2)
    assert str(first) == "loss: the same in 1 rows, then 2.5 and not 2.0 (2.5e-01 of it)"


def test_a_number_where_there_was_none_is_a_difference() -> None:
    found = {**GOLDEN, "loss": [1.0, 2.0, 3.0]}
    assert [each.row for each in differences(GOLDEN, found)] == [0]
