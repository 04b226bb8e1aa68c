"""What both sides of `benchmarl.py` share. Nothing of either library is imported here."""

import dataclasses
import json
import sys
from collections.abc import Callable
from typing import Any

from benchmarks import talking

EPISODE = 25
"""Steps of an episode of the particle worlds."""
TASKS = {"simple_spread": "MPE_simple_spread_v3", "simple_speaker_listener": "MPE_simple_speaker_listener_v4"}
"""The worlds by BenchMARL's names, and JaxMARL's."""


@dataclasses.dataclass(frozen=True)
class Settings:
    """All that has a counterpart on both sides: those of Lowe et al. (2017) but for the updates.

    Theirs are one for each 100 steps; here it is one for each 25, which is skillcrew's default.
    """

    task: str
    steps: int = 200_000
    episodes: int = 10
    """Lived between two rounds of updates."""
    updates: int = 10
    """In a round."""
    batch_size: int = 1024
    learning_rate: float = 0.01
    discount: float = 0.95
    soft_update: float = 0.01
    hidden: tuple[int, ...] = (64, 64)
    scored: int = 200
    """Fresh episodes without noise, in which what was learned is scored."""

    def to_json(self) -> str:
        """For the command line of a side."""
        return json.dumps(dataclasses.asdict(self))

    @classmethod
    def from_json(cls, text: str) -> "Settings":
        """The inverse of `to_json`."""
        values: dict[str, Any] = json.loads(text)
        return cls(**values | {"hidden": tuple(values["hidden"])})


def serve(make: Callable[[Settings], Any]) -> None:
    """Answers the program above, which gave the settings as the first argument.

    Args:
        make: a side, which has `ready` and `answer`.
    """

    def start() -> talking.Started:
        side = make(Settings.from_json(sys.argv[1]))
        return side.ready, side.answer

    talking.serve(start)
