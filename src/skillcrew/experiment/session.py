"""One uninterrupted stretch of a run: its clock, and how much to live before looking up."""

import collections
import contextlib
import time
from collections.abc import Generator

PATIENCE = 2.0
"""Seconds that one call of a program takes about, where a generation is that short: nobody who asks a run to
stop is to wait for longer."""

WATCHED_SECONDS = 5.0
"""Least time between two writings of the metrics for those who watch a run; checkpoints are further apart."""

WATCHED_SHARE = 0.01
"""Of the time, that such writing may take."""

RECENT_SECONDS = 60.0
"""For so long back speed is told: once skills have stopped learning, a run may be twice as fast."""


class Session:
    """Clock of one uninterrupted stretch of a run.

    Args:
        steps_before: environment steps that were lived before.
        most_seconds: after so many it is over; None for no limit.
    """

    def __init__(self, steps_before: int, most_seconds: float | None = None):
        self._began = self._saved = self._called = time.monotonic()
        self._steps_before = steps_before
        self._marks = collections.deque([(self._began, steps_before)])
        self._most_seconds = most_seconds
        self._seconds_each: float | None = None
        self._wrote, self._writing = self._began, 0.0

    def seconds(self) -> float:
        """Since it began."""
        return time.monotonic() - self._began

    def rate(self, steps: int) -> float:
        """Environment steps per second of all seeds together, so far."""
        return (steps - self._steps_before) / self.seconds()

    def recent_rate(self, steps: int) -> float:
        """The same over the last minute, or since it was last asked for before that.

        At least 0: a run that has rolled back has fewer steps than before.
        """
        now = time.monotonic()
        self._marks.append((now, steps))
        while now - self._marks[1][0] >= RECENT_SECONDS:
            self._marks.popleft()
        began, before = self._marks[0]
        return max(0.0, (steps - before) / (now - began))

    def is_over(self) -> bool:
        """Whether its time is up."""
        return self._most_seconds is not None and self.seconds() >= self._most_seconds

    def generations(self, left: int) -> int:
        """How many generations to live in the next call of the program, of those up to the next report."""
        self._called = time.monotonic()
        if self._seconds_each is None:
            return 1
        return max(1, min(left, int(PATIENCE / max(self._seconds_each, 1e-6))))

    def lived(self, generations: int) -> None:
        """That call is back."""
        self._seconds_each = (time.monotonic() - self._called) / generations

    def save_is_due(self, every: float) -> bool:
        """Whether so many seconds have passed since the last save."""
        return time.monotonic() - self._saved >= every

    def saved(self) -> None:
        """The state has just been saved."""
        self._saved = self._wrote = time.monotonic()

    def rows_are_due(self) -> bool:
        """Whether those who watch have waited long enough for new rows of the metrics."""
        return time.monotonic() - self._wrote >= max(WATCHED_SECONDS, self._writing / WATCHED_SHARE)

    @contextlib.contextmanager
    def writing_rows(self) -> Generator[None]:
        """Rows are written within."""
        began = time.monotonic()
        yield
        self._wrote = time.monotonic()
        self._writing = self._wrote - began
