"""Writing files whole or not at all, and disk trouble in one clear line."""

import contextlib
import errno
import os
import shutil
import tempfile
from collections.abc import Callable, Generator
from pathlib import Path

from skillcrew.errors import UserError

MAKE_ROOM = (
    "free some space; then `skillcrew resume` goes on with a run that was training, and any other command "
    "is to be given again"
)

LARGEST_TEXT = 64 * 2**20
"""Bytes."""


@contextlib.contextmanager
def disk_errors(place: Path) -> Generator[None]:
    """Turns a full disk, a read-only folder and the like into a `UserError` that names the place."""
    try:
        yield
    except UserError:
        raise
    except Exception as error:
        reason = _reason(error)
        if reason is None:
            raise
        raise UserError(f"{place}: cannot be written, {reason}") from error


def check_room(place: Path, needed: int) -> None:
    """Says that a disk is too full before anything is written to it.

    Storage libraries that run out of room in the midst of writing fill the terminal with the errors
    of their threads.

    Raises:
        UserError: fewer than `needed` bytes are free at `place`, a folder that exists.
    """
    free = shutil.disk_usage(place).free
    if needed > free:
        raise UserError(
            f"{place}: cannot be written, the disk is full: {needed / 2**20:.1f} MiB may be needed and "
            f"{free / 2**20:.1f} MiB are free; {MAKE_ROOM}"
        )


def read_plain(path: Path) -> str:
    """The text of a file, if it is one: pipes and devices have no end.

    Raises:
        OSError: it is none, cannot be read, or is larger than anything that skillcrew writes as text.
        UnicodeDecodeError: it holds no text.
    """
    if path.exists() and not path.is_file():
        raise OSError(errno.EINVAL, "it is no file")
    if path.stat().st_size > LARGEST_TEXT:
        raise OSError(errno.EFBIG, "it is too large")
    return path.read_text()


def write_whole(path: Path, write: Callable[[Path], object]) -> None:
    """Lets `write` fill a temporary file beside `path`, which then takes its place at once.

    Raises:
        UserError: the disk is full or cannot be written; the old file, if any, is untouched.
    """
    with disk_errors(path):
        handle, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
        os.close(handle)
        temporary = Path(name)
        try:
            write(temporary)
            # A rename may reach the disk before what it names does.
            with temporary.open("rb") as written:
                os.fsync(written.fileno())
            # mkstemp makes files that only their owner can read.
            temporary.chmod(0o644)
            temporary.replace(path)
        finally:
            temporary.unlink(missing_ok=True)


def _reason(error: Exception) -> str | None:
    if isinstance(error, PermissionError) or (isinstance(error, OSError) and error.errno == errno.EROFS):
        return "you may not write there; choose another folder with --out"
    text = str(error)
    # Orbax reports the errors of its C++ storage as text alone.
    if isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG):
        return f"the disk is full; {MAKE_ROOM}"
    if "No space left" in text or "RESOURCE_EXHAUSTED" in text or "File too large" in text:
        return f"the disk is full; {MAKE_ROOM}"
    if "Permission denied" in text or "Read-only file system" in text or "PERMISSION_DENIED" in text:
        return "you may not write there; choose another folder with --out"
    if isinstance(error, OSError):
        return (error.strerror or text).lower()
    return None
