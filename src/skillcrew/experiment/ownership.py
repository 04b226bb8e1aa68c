"""One process at a time trains in a run folder."""

import contextlib
import datetime
import errno
import fcntl
import os
import socket
import stat
from collections.abc import Generator
from pathlib import Path
from typing import TextIO

from skillcrew.errors import UserError
from skillcrew.experiment.files import disk_errors

LOCK = "owner.lock"

HELD = (errno.EWOULDBLOCK, errno.EACCES)
NO_LOCKS = (errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOSYS)
"""Of file systems that know no locks: there, nobody is refused."""


@contextlib.contextmanager
def owned(folder: Path) -> Generator[None]:
    """Holds a run folder; the system lets go of it when this process ends, however that is.

    On a network file system it holds across machines where the system passes locks on, as NFS does.

    Raises:
        UserError: somebody else holds it, or it cannot be written.
    """
    path = folder / LOCK
    with disk_errors(path):
        # It will be emptied, so nothing that a link leads to; and a pipe would be waited for.
        handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND | os.O_NOFOLLOW | os.O_NONBLOCK, 0o666)
        file = open(handle, "a+")  # noqa: SIM115 (closed below)
    with file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            if error.errno in HELD:
                raise UserError(
                    f"{folder}: {_owner(path)} trains in it; wait for its end, or stop it and resume"
                ) from None
            if error.errno not in NO_LOCKS:
                raise
        with disk_errors(path):
            _say(file, f"process {os.getpid()} on {socket.gethostname()} (since {_now()})")
        try:
            yield
        finally:
            with contextlib.suppress(OSError):
                _say(file, "")


def holder(folder: Path) -> str | None:
    """Who trains in a run folder; None if nobody does.

    Nobody who is about to train there is kept from it: what is held by nobody is empty, and only a lock whose
    holder was killed is tried, for an instant.
    """
    try:
        handle = os.open(folder / LOCK, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
    except OSError:
        return None
    with open(handle, "rb") as file:
        if not (stat.S_ISREG(os.fstat(handle).st_mode) and file.read(1)):
            return None
        try:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except OSError:
            # Where the system knows no locks, what the holder wrote is all that there is to go by.
            return _owner(folder / LOCK)
    return None


def _say(file: TextIO, text: str) -> None:
    file.truncate(0)
    file.write(text)
    file.flush()


def _owner(path: Path) -> str:
    """Who holds it; they may be about to say so."""
    with contextlib.suppress(OSError, UnicodeDecodeError):
        return path.read_text()[:200].partition("\n")[0] or "another process"
    return "another process"


def _now() -> str:
    return datetime.datetime.now().astimezone().isoformat(" ", "minutes")
