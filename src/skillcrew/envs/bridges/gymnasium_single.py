"""An environment with a single agent, as Gymnasium steps it."""

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np

from skillcrew.envs.bridges.gymnasium_spaces import action_space, observation_space
from skillcrew.envs.bridges.session import Session
from skillcrew.envs.environment import Environment


class SingleAgentEnv(gymnasium.Env):
    """See `gymnasium_env`."""

    def __init__(self, env: Environment, rewards: Sequence[str] | None, render_mode: str | None):
        self._session = Session(env, rewards, render_mode)
        self.metadata = {"render_modes": ["rgb_array"], "render_fps": 10}
        self.render_mode = render_mode
        ((self._name, (kind, _)),) = self._session.seats.items()
        self.observation_space = observation_space(kind)
        self.action_space = action_space(kind, env.actions)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        super().reset(seed=seed)
        return self._session.reset(seed)[self._name], {}

    def step(self, action: Any) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        moment = self._session.step({self._name: action})
        seen, paid = moment.observations[self._name], moment.rewards[self._name]
        return seen, paid, moment.terminated, moment.truncated, {}

    def render(self) -> Any:
        return self._session.picture()
