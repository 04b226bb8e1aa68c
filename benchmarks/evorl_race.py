"""What both sides of `evorl.py` share: the settings, one seed's run, and the talk with the program above.

Nothing of either library is imported here, for each side runs in an interpreter of its own.
"""

import dataclasses
import json
import time
from typing import Any, Protocol

from benchmarks import talking

TIME_LIMIT = 200
"""Steps of an episode of Pendulum-v1."""


@dataclasses.dataclass(frozen=True)
class Settings:
    """All that has a counterpart on both sides; a generation lasts as long as each side makes it."""

    budget: int = 264_000
    population: int = 10
    episodes: int = 1
    learner_episodes: int = 1
    elites: int = 2
    tournament_size: int = 3
    mutated_share: float = 0.1
    strength: float = 0.1
    large_strength: float = 10.0
    large_probability: float = 0.05
    reset_probability: float = 0.05
    migration_period: int = 1
    updates_per_episode: int = 40
    """Critic updates, so that both sides learn as much from as many environment steps."""
    hidden: tuple[int, ...] = (64, 64)
    learning_rate: float = 1e-3
    discount: float = 0.99
    soft_update: float = 0.005
    batch_size: int = 256
    policy_delay: int = 2
    target_noise: float = 0.2
    target_noise_clip: float = 0.5
    exploration_noise: float = 0.1
    buffer_capacity: int = 300_000
    marks: int = 10
    """Points of the learning curve, at equal distances, the last at the end of the budget."""
    evaluation_episodes: int = 200


class Side(Protocol):
    """One library's ERL. A state is whatever it needs to go on."""

    def compile(self) -> None:
        """Makes the first state and compiles a generation."""
        ...

    def start(self, seed: int) -> Any:
        """The state before the first generation."""
        ...

    def step(self, state: Any) -> Any:
        """The state after one more generation, computed to the end."""
        ...

    def steps(self, state: Any) -> int:
        """Environment steps so far, as the library itself counts them."""
        ...

    def evaluate(self, state: Any, seed: int) -> dict[str, float]:
        """Mean return of the population's best and of the learner over fresh episodes without noise."""
        ...

    def parity(self, record: dict[str, Any] | None) -> dict[str, Any]:
        """Records random episodes, or replays those of a record."""
        ...

    def versions(self) -> dict[str, str]:
        """Of the packages that matter."""
        ...


def run(side: Side, seed: int, settings: Settings) -> dict[str, Any]:
    """One seed's learning curve. Evaluations count neither as steps nor as seconds."""
    state = side.start(seed)
    curve: list[dict[str, float]] = []
    steps, generations, wall, processor = 0, 0, 0.0, 0.0
    while steps < settings.budget:
        clock, own_clock = time.perf_counter(), time.process_time()
        state = side.step(state)
        wall += time.perf_counter() - clock
        processor += time.process_time() - own_clock
        generations += 1
        steps = side.steps(state)
        if steps >= settings.budget * (len(curve) + 1) / settings.marks:
            curve.append({"steps": steps, "seconds": wall, **side.evaluate(state, seed)})
    return {"curve": curve, "generations": generations, "wall": wall, "processor": processor}


def serve(make: Any, settings: Settings) -> None:
    """Compiles a side, says how long that took, and answers the program above."""

    def start() -> talking.Started:
        side: Side = make(settings)
        clock, own_clock = time.perf_counter(), time.process_time()
        side.compile()
        wall, processor = time.perf_counter() - clock, time.process_time() - own_clock

        def answer(command: dict[str, Any]) -> dict[str, Any]:
            if command["do"] == "run":
                return run(side, command["seed"], settings)
            return side.parity(command.get("record"))

        return {"wall": wall, "processor": processor, "versions": side.versions()}, answer

    talking.serve(start)


def settings_of(text: str) -> Settings:
    """The inverse of `json.dumps(dataclasses.asdict(settings))`."""
    values: dict[str, Any] = json.loads(text)
    values["hidden"] = tuple(values["hidden"])
    return Settings(**values)
