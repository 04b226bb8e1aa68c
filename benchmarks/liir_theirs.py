"""Starts LIIR's authors' program, as it lies in their checkout, on a matrix game in the place of StarCraft.

    python liir_theirs.py CHECKOUT GAME [OPTION=VALUE ...]     # by an interpreter that has torch and sacred

It is of 2019. What its interpreter and libraries did then and do no more is brought back here, and nothing
else: names that have moved, a configuration that a program may write to, and optimisers whose steps PyTorch
did not see as changes of what it is yet to differentiate.
"""

import collections
import collections.abc
import contextlib
import functools
import os
import runpy
import sys
import types
from pathlib import Path
from typing import Any

import numpy as np
import sacred
import torch
import yaml

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
from benchmarks.matrix_games import GAMES, LENGTH


class MatrixGame:
    """Two agents choose, and the team is paid; nothing is seen.

    Choice 0 is there for nobody: in StarCraft it is that of the dead, and who can make it does not learn.
    """

    n_agents = 2
    episode_limit = LENGTH

    def __init__(self, map_name: str, **_of_starcraft: Any):
        self.payoff = np.array(GAMES[map_name], np.float64)
        self.now = 0

    def reset(self) -> None:
        self.now = 0

    def step(self, actions: Any) -> tuple[float, bool, dict[str, Any]]:
        self.now += 1
        over = self.now >= LENGTH
        first, second = (int(action) - 1 for action in actions)
        return float(self.payoff[first, second]), over, {"episode_limit": True} if over else {}

    def get_obs(self) -> list[np.ndarray]:
        return [np.zeros(1, np.float32)] * self.n_agents

    def get_state(self) -> np.ndarray:
        return np.zeros(1, np.float32)

    def get_avail_actions(self) -> list[list[int]]:
        return [[0, *[1] * len(self.payoff)]] * self.n_agents

    def get_env_info(self) -> dict[str, int]:
        return {
            "state_shape": 1,
            "obs_shape": 1,
            "n_actions": len(self.payoff) + 1,
            "n_agents": self.n_agents,
            "episode_limit": LENGTH,
        }

    def get_stats(self) -> dict[str, Any]:
        return {}

    def close(self) -> None:
        """Nothing is open."""


def as_in_2019() -> None:
    """Brings back what has changed."""
    collections.Mapping = collections.abc.Mapping  # type: ignore[attr-defined]
    yaml.load = functools.partial(yaml.load, Loader=yaml.SafeLoader)
    sacred.SETTINGS["CONFIG"]["READ_ONLY_CONFIG"] = False
    unseen = torch.optim.RMSprop.step

    def step(optimiser: torch.optim.RMSprop) -> None:
        with contextlib.ExitStack() as stack:
            for group in optimiser.param_groups:
                for parameter in group["params"]:
                    stack.enter_context(torch.autograd._unsafe_preserve_version_counter(parameter))
            unseen(optimiser)

    torch.optim.RMSprop.step = step  # type: ignore[method-assign,assignment]
    simulator = types.ModuleType("smac.env")
    simulator.MultiAgentEnv = object  # type: ignore[attr-defined]
    simulator.StarCraft2Env = MatrixGame  # type: ignore[attr-defined]
    sys.modules |= {"smac": types.ModuleType("smac"), "smac.env": simulator}


def main() -> None:
    """Never comes back: their program ends the interpreter."""
    source = Path(sys.argv[1]).absolute() / "src"
    as_in_2019()
    torch.set_num_threads(1)
    os.chdir(source.parent)
    sys.path.insert(0, str(source))
    words = ["--config=liir_smac", "--env-config=sc2", f"--map={sys.argv[2]}"]
    sys.argv = [str(source / "main.py"), *words, "with", *sys.argv[3:]]
    runpy.run_path(sys.argv[0], run_name="__main__")


if __name__ == "__main__":
    main()
