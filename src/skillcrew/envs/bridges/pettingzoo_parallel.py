"""A team, as PettingZoo steps it."""

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
import pettingzoo

from skillcrew.envs.bridges.gymnasium_spaces import action_space, observation_space
from skillcrew.envs.bridges.session import Session
from skillcrew.envs.environment import Environment
from skillcrew.envs.offers import OffersCentralState, require

Observations = dict[str, np.ndarray]
Infos = dict[str, dict[str, Any]]


class TeamEnv(pettingzoo.ParallelEnv):
    """See `pettingzoo_env`."""

    def __init__(self, env: Environment, rewards: Sequence[str] | None, render_mode: str | None):
        self._session = Session(env, rewards, render_mode)
        self.metadata = {"name": env.name, "render_modes": ["rgb_array"], "render_fps": 10}
        self.render_mode = render_mode
        self.possible_agents = list(self._session.seats)
        self.agents: list[str] = []
        seats = self._session.seats.items()
        self.observation_spaces = {agent: observation_space(seat.kind) for agent, seat in seats}
        self.action_spaces = {agent: action_space(seat.kind, env.actions) for agent, seat in seats}

    def observation_space(self, agent: str) -> gymnasium.Space:
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> gymnasium.Space:
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observations, Infos]:
        self.agents = list(self.possible_agents)
        return self._session.reset(seed), self._infos()

    def step(
        self, actions: dict[str, Any]
    ) -> tuple[Observations, dict[str, float], dict[str, bool], dict[str, bool], Infos]:
        """Moves all agents; a team's episode is over for all of them at once, and nothing follows."""
        if not self.agents:
            return {}, {}, {}, {}, {}
        moment = self._session.step(actions)
        terminated = dict.fromkeys(self.agents, moment.terminated)
        truncated = dict.fromkeys(self.agents, moment.truncated)
        infos = self._infos()
        if moment.terminated or moment.truncated:
            self.agents = []
        return moment.observations, moment.rewards, terminated, truncated, infos

    def render(self) -> Any:
        return self._session.picture()

    def state(self) -> np.ndarray:
        """The environment's `central_state`, where it offers one; a `UserError` where not."""
        central = require(self._session.env, OffersCentralState, "state()")
        return np.asarray(central.central_state(self._session.state("state")))

    def _infos(self) -> Infos:
        return {agent: {} for agent in self.agents}
