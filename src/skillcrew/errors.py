"""The one kind of error that is the user's to mend, and help with misspelt names."""

import difflib
import traceback
from collections.abc import Iterable

LONGEST_LINE = 1600
"""Letters; what a file holds may be quoted in a line of ours, and has no bounds."""


LESS_MEMORY = (
    "lower the number of --seeds or of episodes, --algorithm.population, batch sizes or "
    "--algorithm.buffer-capacity"
)
"""What to do where memory is short."""


class UserError(Exception):
    """Something that the user can mend: one line that says what, where, and how.

    The command line prints the message alone and exits with code 2. It is no `ValueError`, so
    that parsers of options and files let it through as it is.
    """

    def __init__(self, message: str):
        super().__init__(one_line(message))


class Notice(UserWarning):
    """Something that a user did not ask for and should know; the command line prints its line alone."""


def out_of_memory(error: BaseException) -> bool:
    """Whether Python or XLA asked the system for more memory than it would give."""
    return isinstance(error, MemoryError) or (
        type(error).__name__ == "JaxRuntimeError" and "out of memory" in str(error).lower()
    )


def one_line(text: str) -> str:
    """A text as one line that any terminal shows as it is, whatever words and files have put into it.

    What is no printable letter is written as Python writes it; of a text that is very long, the middle is
    left out.
    """
    if len(text) > LONGEST_LINE:
        text = f"{text[: LONGEST_LINE // 2]} … {text[-LONGEST_LINE // 2 :]}"
    return "".join(
        letter if letter.isprintable() else letter.encode("unicode_escape").decode() for letter in text
    )


def nearest_first(name: str, valid: Iterable[str]) -> list[str]:
    """The valid names, those most alike to ``name`` first, the rest in their own order."""
    names = list(valid)
    return sorted(
        names,
        key=lambda other: -difflib.SequenceMatcher(None, name.lower(), other.lower()).ratio(),
    )


def unknown_name(kind: str, name: str, valid: Iterable[str]) -> UserError:
    """The error for a name that does not exist: the valid ones, nearest first."""
    return UserError(
        f"unknown {kind} '{name}'; valid, nearest first: " + ", ".join(nearest_first(name, valid))
    )


def place_of_failure(error: BaseException) -> str:
    """The file and line of somebody's own code in which an error was raised."""
    if isinstance(error, SyntaxError) and error.filename:
        return f"{error.filename}, line {error.lineno}"
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if "site-packages" not in frame.filename] or frames
    return f"{own[-1].filename}, line {own[-1].lineno}"
