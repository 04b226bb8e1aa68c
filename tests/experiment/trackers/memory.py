"""A tracker that keeps its records in memory."""

from collections import defaultdict
from typing import ClassVar


class Memory:
    """Of all runs of a test, by seed: the generations that it was told of, and what came in the end."""

    told: ClassVar = defaultdict(list)
    concluded: ClassVar = []
    closed = 0
    fails_at = None

    def __init__(self, tracked):
        self.tracked = tracked

    @classmethod
    def forget(cls):
        cls.told, cls.concluded, cls.closed, cls.fails_at = defaultdict(list), [], 0, None

    @staticmethod
    def check(): ...

    def record(self, seed, columns):
        generations = columns["generation"].tolist()
        if Memory.fails_at is not None and max(generations) >= Memory.fails_at:
            raise OSError("no space\nleft")
        Memory.told[seed] += generations

    def conclude(self, seed, steps, scores, figures):
        Memory.concluded.append((seed, steps, scores, figures))

    def flush(self): ...

    def close(self):
        Memory.closed += 1
