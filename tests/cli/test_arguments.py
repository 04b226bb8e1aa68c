"""How values are written on the command line."""

import pytest

from skillcrew.cli.arguments import (
    format_groups,
    format_parents,
    parse_count,
    parse_groups,
    parse_parents,
    parse_seeds,
)
from skillcrew.errors import UserError


@pytest.mark.parametrize(("text", "number"), [("4e6", 4_000_000), ("1_000", 1000), ("7", 7), ("-2", -2)])
def test_counts(text, number):
    assert parse_count(text) == number


def test_large_counts_are_exact():
    # A seed or budget of more than 53 bits must not be rounded on its way through a float.
    assert parse_count("9007199254740993") == 9007199254740993


@pytest.mark.parametrize("text", ["", "x", "1.5", "nan", "inf", "1e999", "5 5"])
def test_what_is_no_count(text):
    with pytest.raises(UserError, match="whole number"):
        parse_count(text)


@pytest.mark.parametrize(
    ("text", "seeds"),
    [("1", (0,)), ("3", (0, 1, 2)), ("4..4", (4,)), ("2000..2002", (2000, 2001, 2002)), ("9,1", (9, 1))],
)
def test_seeds(text, seeds):
    assert parse_seeds(text) == seeds


@pytest.mark.parametrize(
    "text", ["", "-1", "a", "1..", "..3", "3..1", "1;2", "1,a", ",1", "0", "1.5", "1e3x"]
)
def test_what_are_no_seeds(text):
    with pytest.raises(UserError, match="--seeds"):
        parse_seeds(text)


def test_a_seed_that_was_taken_for_a_count_is_told_how_it_is_said():
    with pytest.raises(UserError, match=r"2000 runs in one program; .* the seed 2000 alone is 2000\.\.2000"):
        parse_seeds("2000")


@pytest.mark.parametrize("text", ["default", "none", "B:A", "B:A,C:A+B"])
def test_parents_there_and_back(text):
    assert format_parents(parse_parents(text)) == text


def test_parents():
    assert parse_parents("B:A, C:A+B") == {"B": ("A",), "C": ("A", "B")}
    assert parse_parents("none") == {} and parse_parents("default") is None
    for text in ("", "B", "B:", ":A", "B:A+", "B:A;C:A", "B=A"):
        with pytest.raises(UserError, match="TYPE:PARENT"):
            parse_parents(text)


@pytest.mark.parametrize(
    ("text", "groups"),
    [("none", ()), ("A+B", (("A", "B"),)), ("A+B,C+D+E", (("A", "B"), ("C", "D", "E"))), ("A", (("A",),))],
)
def test_groups_there_and_back(text, groups):
    assert parse_groups(text) == groups
    assert format_groups(groups) == text


@pytest.mark.parametrize("text", ["", "A+", "+A", "A+B,", "A+B;C+D", "A:B", "A++B"])
def test_what_are_no_groups(text):
    with pytest.raises(UserError, match=r"simultaneous: write TYPE\+TYPE, such as A\+B,C\+D, or none"):
        parse_groups(text)
