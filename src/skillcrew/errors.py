"""The one kind of error that is the user's to mend, and help with misspelt names."""

import difflib
import traceback
from collections.abc import Iterable


class UserError(Exception):
    """Something that the user can mend: one line that says what, where, and how.

    The command line prints the message alone and exits with code 2. It is no `ValueError`, so
    that parsers of options and files let it through as it is.
    """


class Notice(UserWarning):
    """Something that a user did not ask for and should know; the command line prints its line alone."""


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
