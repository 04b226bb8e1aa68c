"""The matrix games as Gymnasium has them, for EPyMARL: `benchmarks.epymarl_theirs:climbing-v0` and so on."""

from typing import Any

import gymnasium
import numpy as np
from benchmarks.matrix_games import GAMES


class MatrixGame(gymnasium.Env):
    """Two agents, each with an observation, a choice and a reward of its own; EPyMARL ends it by time."""

    n_agents = 2

    def __init__(self, game: str):
        self.payoff = np.array(GAMES[game], np.float64)
        self.action_space = gymnasium.spaces.Tuple([gymnasium.spaces.Discrete(len(self.payoff))] * 2)
        self.observation_space = gymnasium.spaces.Tuple([gymnasium.spaces.Box(0.0, 1.0, (1,))] * 2)

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Any, dict[str, Any]]:
        return self._seen(), {}

    def step(self, action: Any) -> tuple[Any, list[float], bool, bool, dict[str, Any]]:
        paid = float(self.payoff[action[0], action[1]])
        return self._seen(), [paid, paid], False, False, {}

    def _seen(self) -> tuple[np.ndarray, ...]:
        return (np.zeros(1, np.float32),) * 2


for game in GAMES:
    gymnasium.register(f"{game}-v0", MatrixGame, disable_env_checker=True, kwargs={"game": game})
