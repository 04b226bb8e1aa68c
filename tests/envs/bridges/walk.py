"""A world on the host, of chance that its seed decides, which minds being stepped after its end."""

import dataclasses

import numpy as np

from skillcrew.envs.bridges.host_config import HostConfig
from skillcrew.envs.bridges.host_environment import HostEnvironment
from skillcrew.envs.bridges.host_world import Agent, Moved

ALIKE = (Agent("walker_0", 4, 2, "continuous"), Agent("walker_1", 4, 2, "continuous"))
DIFFERENT = (
    Agent("cat_0", 3, 2, "continuous"),
    Agent("cat_1", 3, 2, "continuous"),
    Agent("mouse_0", 5, 1, "continuous"),
)
INDICES = tuple(Agent(f"picker_{index}", 2, 4, "discrete") for index in range(3))


class Walk:
    """Sums up its actions and noise. Ends by itself after 2 to 6 steps, which the seed decides, if `ends`."""

    def __init__(self, agents=ALIKE, ends=True, max_steps=7):
        self.agents, self.ends, self.max_steps = agents, ends, max_steps
        self.resets = self.steps = 0
        self.broken = False

    def reset(self, seed):
        self.resets += 1
        self.rng = np.random.default_rng(seed)
        self.last, self.time = 2 + seed % 5, 0
        self.sums = self.rng.normal(size=len(self.agents))
        return self._seen()

    def step(self, action):
        assert not (self.ends and self.time >= self.last), "stepped after its end"
        if self.broken:
            raise RuntimeError("the simulator gave up")
        self.steps += 1
        self.time += 1
        parts = np.split(np.asarray(action, float), np.cumsum([agent.numbers for agent in self.agents])[:-1])
        self.sums = self.sums + [part.sum() for part in parts] + self.rng.normal(size=len(parts))
        terminated = self.ends and self.time >= self.last
        truncated = not terminated and self.time >= self.max_steps
        return Moved(self._seen(), self.sums.astype(np.float32) * 2, terminated, truncated)

    def _seen(self):
        rows = [
            [total * (place + 1) for place in range(agent.observation_size)]
            for total, agent in zip(self.sums, self.agents, strict=True)
        ]
        return np.concatenate(rows).astype(np.float32)


@dataclasses.dataclass(frozen=True)
class WalkConfig(HostConfig):
    """Walks."""

    def imports(self):
        return ""

    def called(self):
        return "walk"


class WalkEnvironment(HostEnvironment):
    """Keeps count of the worlds that it makes."""

    def __init__(self, agents=ALIKE, ends=True, max_steps=7, **options):
        self.worlds = []

        def make():
            self.worlds.append(Walk(agents, ends, max_steps))
            return self.worlds[-1]

        super().__init__(WalkConfig(**options), make)

    @property
    def resets(self):
        return sum(world.resets for world in self.worlds)


def live(agents, seed, actions, ends=True, max_steps=7):
    """What one world shows and pays, step by step, as a Python loop sees it."""
    world = Walk(agents, ends, max_steps)
    shown, moved = [world.reset(seed)], []
    for action in actions:
        moved.append(world.step(action))
        shown.append(moved[-1].observation)
        if moved[-1].terminated or moved[-1].truncated:
            break
    return shown, moved
