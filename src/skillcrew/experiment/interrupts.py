"""Ctrl-C means: finish the chunk, save, and say how to go on."""

import contextlib
import signal
import threading
from collections.abc import Generator
from types import FrameType


class Interrupts:
    """Whether somebody asked the run to stop."""

    def __init__(self) -> None:
        self.requested = False

    def _note(self, number: int, frame: FrameType | None) -> None:
        # The second request is meant: whoever sends it does not want to wait for the chunk.
        if self.requested:
            raise KeyboardInterrupt
        self.requested = True


@contextlib.contextmanager
def watch_interrupts() -> Generator[Interrupts]:
    """Notes SIGINT and SIGTERM instead of dying of them; outside the main thread there are none to note."""
    interrupts = Interrupts()
    if threading.current_thread() is not threading.main_thread():
        yield interrupts
        return
    numbers = (signal.SIGINT, signal.SIGTERM)
    before = {number: signal.signal(number, interrupts._note) for number in numbers}
    try:
        yield interrupts
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
