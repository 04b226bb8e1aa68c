"""One command line in this process, and all that can be seen of it: exit code, words, errors, a hang."""

import contextlib
import dataclasses
import os
import signal
import sys
import tempfile
import traceback
from collections.abc import Generator, Sequence

from skillcrew.cli.main import run_command

BUSY = 6
"""How many others may want the processor at the same time."""


class Hung(BaseException):
    """It took longer than it may; not an `Exception`, which programs catch."""


@dataclasses.dataclass(frozen=True)
class Outcome:
    """How a command line ended.

    `code` is None where it raised or hung; `raised` is the traceback then, and empty for a hang.
    """

    code: int | None
    out: str
    err: str
    raised: str = ""

    @property
    def hung(self) -> bool:
        return self.code is None and not self.raised


def observe(words: Sequence[str], seconds: float) -> Outcome:
    """Runs a command line as `skillcrew` does, with what it and the libraries below it print caught."""
    code, raised = None, ""
    with captured() as said:
        try:
            with alarm(seconds):
                code = run_command(list(words))
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else 0 if end.code is None else 1
        except Hung:
            pass
        except BaseException:
            raised = traceback.format_exc()
    return Outcome(code, *said, raised)


@contextlib.contextmanager
def captured() -> Generator[list[str]]:
    """Catches standard output and errors where the system keeps them: C++ libraries know no `sys.stderr`.

    The list holds both texts once the block has been left.
    """
    said: list[str] = []
    sys.stdout.flush()
    sys.stderr.flush()
    kept = [os.dup(1), os.dup(2)]
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        os.dup2(out.fileno(), 1)
        os.dup2(err.fileno(), 2)
        streams = [
            os.fdopen(os.dup(number), "w", encoding="utf-8", errors="backslashreplace") for number in (1, 2)
        ]
        try:
            with contextlib.redirect_stdout(streams[0]), contextlib.redirect_stderr(streams[1]):
                yield said
        finally:
            for stream in streams:
                stream.close()
            for number, copy in zip((1, 2), kept, strict=True):
                os.dup2(copy, number)
                os.close(copy)
            for file in (out, err):
                file.seek(0)
                said.append(file.read().decode(errors="replace"))


@contextlib.contextmanager
def alarm(seconds: float) -> Generator[None]:
    """Raises `Hung` in the block after so many seconds of work, or `BUSY` times as many on the clock."""

    def ring(*_: object) -> None:
        raise Hung

    timers = {
        signal.SIGPROF: (signal.ITIMER_PROF, seconds),
        signal.SIGALRM: (signal.ITIMER_REAL, BUSY * seconds),
    }
    before = {number: signal.signal(number, ring) for number in timers}
    for timer, limit in timers.values():
        signal.setitimer(timer, limit)
    try:
        yield
    finally:
        for number, (timer, _) in timers.items():
            signal.setitimer(timer, 0)
            signal.signal(number, before[number])
