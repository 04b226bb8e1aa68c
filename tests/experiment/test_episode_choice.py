"""Which episode a word or a number means."""

import numpy as np
import pytest

import skillcrew as sc
from skillcrew.experiment.episode_choice import chosen_episode, described
from skillcrew.experiment.recording import Shown


def played(solved, steps=(5, 6, 2, 9, 3), returns=(0.0, 2.0, -1.5, 3.0, 1.0)):
    solved = None if solved is None else np.array(solved, bool)
    return Shown(7, 5, np.arange(5), np.array(returns), solved, np.array(steps), None)


MIXED = played([0, 1, 0, 1, 1])


@pytest.mark.parametrize(
    ("word", "index"), [("solved", 1), ("failed", 0), ("fastest", 4), ("slowest", 3), ("2", 2), (None, 4)]
)
def test_words_and_numbers(word, index):
    assert chosen_episode(MIXED, word) == index


@pytest.mark.parametrize(("word", "index"), [("best", 3), ("worst", 2), ("4", 4), (None, 3)])
def test_by_return_where_nothing_says_what_success_is(word, index):
    assert chosen_episode(played(None), word) == index


def test_the_page_opens_with_the_first_where_none_was_solved():
    assert chosen_episode(played([0] * 5)) == 0


@pytest.mark.parametrize(
    ("of", "word", "said"),
    [
        (MIXED, "5", "--episode 5: give fastest, slowest, solved, failed or a number from 0 to 4"),
        (MIXED, "-1", "--episode -1: give"),
        (MIXED, "best", "--episode best: give fastest"),
        (played(None), "failed", "--episode failed: give best, worst or a number from 0 to 4"),
        (
            played([1] * 5),
            "failed",
            "--episode failed: all of the 5 episodes of seed 7 were solved; give solved",
        ),
        (
            played([0] * 5),
            "fastest",
            "--episode fastest: none of the 5 episodes of seed 7 were solved; give failed",
        ),
    ],
)
def test_what_is_not_there_is_said(of, word, said):
    with pytest.raises(sc.UserError, match=f"^{said}"):
        chosen_episode(of, word)


def test_what_is_said_of_an_episode():
    assert described(MIXED, 1) == "solved in 6 steps" and described(MIXED, 0) == "failed, 5 steps"
    assert described(played(None, steps=[1] * 5), 2) == "return -1.5, 1 step"
