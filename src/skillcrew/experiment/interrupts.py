"""A signal to stop means: finish the generation, save, and say how to go on."""

import contextlib
import signal
import threading
from collections.abc import Generator
from types import FrameType

from skillcrew.errors import unknown_name

STOPS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)

UNSUITABLE = ("KILL", "STOP", "CHLD", "SEGV", "BUS", "ILL", "FPE", "ABRT")
"""Signals that cannot be waited for, or that say something else."""


class Interrupts:
    """Whether somebody asked the run to stop."""

    def __init__(self) -> None:
        self.requested = False

    def _note(self, number: int, frame: FrameType | None) -> None:
        # The second request is meant: whoever sends it does not want to wait for the generation.
        if self.requested:
            raise KeyboardInterrupt
        self.requested = True


@contextlib.contextmanager
def watch_interrupts(warning: str | None = None) -> Generator[Interrupts]:
    """Notes SIGINT, SIGTERM and SIGHUP instead of dying of them; none outside the main thread.

    Args:
        warning: a further signal, by name.
    """
    interrupts = Interrupts()
    if threading.current_thread() is not threading.main_thread():
        yield interrupts
        return
    noted = {*STOPS, *([signal_of(warning)] if warning else [])}
    if signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
        # Whoever started this by `nohup` does not want it to end with the terminal.
        noted.discard(signal.SIGHUP)
    before = {number: signal.signal(number, interrupts._note) for number in noted}
    try:
        yield interrupts
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def signal_of(name: str) -> signal.Signals:
    """The signal of a name such as USR1 or SIGUSR1.

    Raises:
        UserError: there is none, or it cannot be waited for.
    """
    known: dict[str, signal.Signals] = {number.name.removeprefix("SIG"): number for number in signal.Signals}
    plain = name.upper().removeprefix("SIG")
    if plain not in known or plain in UNSUITABLE:
        usual = [other for other in known if other not in UNSUITABLE]
        raise unknown_name("signal", name, usual)
    return known[plain]
