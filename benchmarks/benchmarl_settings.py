"""What both sides of `benchmarl.py` share. Nothing of either library is imported here."""

import dataclasses
import json
from typing import Any

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
