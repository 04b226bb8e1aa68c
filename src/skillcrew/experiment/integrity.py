"""Digests of what was written, so that damage is noticed before anything is believed."""

import hashlib
import json
import os
from collections.abc import Callable
from pathlib import Path

from skillcrew.errors import UserError
from skillcrew.experiment.files import read_plain, write_whole

DIGESTS = "digests.json"
"""Of the files beside it: SHA-256 by path."""


def seal(folder: Path) -> None:
    """Writes down the digests of all files of a folder that is finished, after them.

    Raises:
        UserError: the disk is full or cannot be written.
    """
    files = sorted(path for path in folder.rglob("*") if path.is_file() and path.name != DIGESTS)
    _write(folder, {path.relative_to(folder).as_posix(): [_digest(path)] for path in files})


def damage(folder: Path) -> str | None:
    """What is wrong with a sealed folder: None if all its files are as they were when it was sealed."""
    if not (folder / DIGESTS).exists():
        return "was never finished"
    known = _read(folder)
    if known is None:
        return f"{DIGESTS} is damaged"
    for name, digests in known.items():
        path = folder / name
        # Unlike `Path.is_file`, which raises where a name is too long for any file.
        if not os.path.isfile(path):
            return f"{name} is missing"
        if not _is_among(digests, path):
            return f"{name} is damaged"
    return None


def fingerprint(folder: Path) -> str:
    """The digest of a sealed folder with all that it holds."""
    return _digest(folder / DIGESTS)


def write_known(path: Path, write: Callable[[Path], object]) -> None:
    """As `write_whole`, and writes the digest down beside the file, for `check_known`.

    An interruption at any instant leaves the old file or the new one, and either is known.

    Raises:
        UserError: the disk is full or cannot be written; the old file, if any, is untouched.
    """

    def write_and_note(temporary: Path) -> None:
        write(temporary)
        known = (_read(path.parent) if (path.parent / DIGESTS).exists() else None) or {}
        _write(path.parent, {**known, path.name: [*known.get(path.name, [])[-1:], _digest(temporary)]})

    write_whole(path, write_and_note)


def check_known(path: Path, mend: str) -> None:
    """Refuses a file that is not as it was written; one that nothing is known of, or that is gone, passes.

    Args:
        mend: what else to do about it.

    Raises:
        UserError: damaged, or changed by somebody.
    """
    digests = path.parent / DIGESTS
    if not digests.exists() or not path.is_file():
        return
    known = _read(path.parent)
    if known is None:
        raise UserError(f"{digests}: damaged; delete it if {path.name} is as you know it")
    if path.name in known and not _is_among(known[path.name], path):
        raise UserError(
            f"{path}: damaged, or changed since it was written; {mend}, or delete {digests} if the change is "
            "meant"
        )


def _is_among(digests: list[str], path: Path) -> bool:
    """Whether a file has one of some digests; one that cannot be read has none."""
    try:
        return _digest(path) in digests
    except OSError:
        return False


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _write(folder: Path, known: dict[str, list[str]]) -> None:
    text = json.dumps(known, indent=0) + "\n"
    write_whole(folder / DIGESTS, lambda path: path.write_text(text))


def _read(folder: Path) -> dict[str, list[str]] | None:
    """The digests that are known of each file; None if they cannot be read."""
    try:
        known = json.loads(read_plain(folder / DIGESTS))
    except (OSError, ValueError, RecursionError):
        return None
    sound = isinstance(known, dict) and all(
        isinstance(digests, list) and all(isinstance(digest, str) for digest in digests)
        for digests in known.values()
    )
    return known if sound else None
