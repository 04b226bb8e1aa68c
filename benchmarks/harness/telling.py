"""How far a harness is."""

import sys
import time
from collections.abc import Iterator, Sequence

SECONDS = 60.0
"""Between two lines."""


def told(cases: Sequence[int], problems: Sequence[str]) -> Iterator[int]:
    """Passes cases on; each minute a line on standard error says how many, and what went wrong so far."""
    began = last = time.monotonic()
    seen = 0
    for done, case in enumerate(cases):
        yield case
        for problem in problems[seen:]:
            print(problem, file=sys.stderr, flush=True)
        seen = len(problems)
        if (now := time.monotonic()) - last >= SECONDS:
            last = now
            print(f"{done + 1:,} of {len(cases):,} in {now - began:.0f} s", file=sys.stderr, flush=True)
