"""Command lines in processes of their own that need not import anything, and what may befall them.

A fork of a process that has imported JAX, and has not used it, begins where a fresh one would after seconds.
"""

import dataclasses
import os
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Callable


@dataclasses.dataclass(frozen=True)
class Ended:
    """How a forked process ended."""

    code: int | None
    """None if it was killed."""
    said: str
    seconds: float


def forked(
    work: Callable[[], int | None], after: float = float("inf"), befall: Callable[[int], None] | None = None
) -> Ended:
    """Does some work in a fork, and in processes that this may start, and waits for its end.

    Args:
        work: returns an exit code; what it prints, and the traceback of what it raises, is caught.
        after: seconds until something befalls it, if it is not done by then.
        befall: what that is, given the process, which leads a group of all of them; by default they are
            killed, as by a power cut.
    """
    with tempfile.TemporaryFile() as file:
        sys.stdout.flush()
        sys.stderr.flush()
        began, child = time.monotonic(), os.fork()
        if child == 0:
            _be_child(work, file.fileno())
        code = _wait(child, began + after, befall or kill)
        seconds = time.monotonic() - began
        file.seek(0)
        return Ended(code, file.read().decode(errors="replace"), seconds)


def _be_child(work: Callable[[], int | None], output: int) -> None:
    code = 1
    try:
        os.setsid()
        os.dup2(output, 1)
        os.dup2(output, 2)
        code = work() or 0
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else 0 if end.code is None else 1
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def _wait(child: int, until: float, befall: Callable[[int], None]) -> int | None:
    while True:
        ended, status = os.waitpid(child, os.WNOHANG)
        if ended:
            code = os.waitstatus_to_exitcode(status)
            return None if code == -signal.SIGKILL else code
        if time.monotonic() >= until:
            befall(child)
            until = float("inf")
        time.sleep(0.005)


def kill(leader: int) -> None:
    """Kills a process and those that it has started."""
    try:
        os.killpg(leader, signal.SIGKILL)
    except ProcessLookupError:
        # It has not made itself a leader yet.
        os.kill(leader, signal.SIGKILL)
