"""Which of a champion's episodes is meant by a word or a number, and what is said of one."""

import numpy as np

from skillcrew.errors import UserError
from skillcrew.experiment.recording import Shown
from skillcrew.experiment.score import RETURN

BY_ENDING = {"fastest": (True, 1), "slowest": (True, -1), "solved": (True, 0), "failed": (False, 0)}
"""Whether it was solved, and whether few steps or many come first; 0: in the order of numbers."""

BY_RETURN = ("best", "worst")
"""Where nothing says what success is."""


def chosen_episode(played: Shown, word: str | None = None) -> int:
    """The index of an episode among all that were played.

    Args:
        played: as `episodes_of` gives them.
        word: a number as the page of the run has it, or one of `BY_ENDING`; where nothing says what success
            is, one of `BY_RETURN`. By default what the page opens with: the fastest, the first if none was
            solved, or the best.

    Raises:
        UserError: there is no such episode; the line says which there are.
    """
    if word is None:
        word = "best" if played.solved is None else "fastest" if played.solved.any() else "failed"
    numbers = f"a number from 0 to {len(played.number) - 1}"
    if word.isdecimal() and int(word) < len(played.number):
        return int(word)
    words = BY_RETURN if played.solved is None else tuple(BY_ENDING)
    if word not in words:
        raise UserError(f"--episode {word}: give {', '.join(words)} or {numbers}")
    if played.solved is None:
        return int(played.returns.argmax() if word == "best" else played.returns.argmin())
    is_solved, order = BY_ENDING[word]
    among = np.flatnonzero(played.solved == is_solved)
    if not len(among):
        count = f"{'none' if is_solved else 'all'} of the {len(played.number)} episodes of seed {played.seed}"
        other = "failed" if is_solved else "solved"
        raise UserError(f"--episode {word}: {count} were solved; give {other} or {numbers}")
    return int(among[np.argmin(order * played.steps[among])])


def described(played: Shown, index: int) -> str:
    """How an episode ended, as the page says it."""
    steps = f"{played.steps[index]} step{'' if played.steps[index] == 1 else 's'}"
    if played.solved is None:
        return f"return {RETURN.number(played.returns[index])}, {steps}"
    return f"solved in {steps}" if played.solved[index] else f"failed, {steps}"
