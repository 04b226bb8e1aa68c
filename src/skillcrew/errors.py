"""The one kind of error that is the user's to mend, and help with misspelt names."""

import difflib
from collections.abc import Iterable


class UserError(Exception):
    """Something that the user can mend: one line that says what, where, and how.

    The command line prints the message alone and exits with code 2. It is no `ValueError`, so
    that parsers of options and files let it through as it is.
    """


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
