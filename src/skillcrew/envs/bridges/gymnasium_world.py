"""Gymnasium's environments as teams of one."""

from collections.abc import Mapping
from typing import Any

import gymnasium
import numpy as np
from jaxtyping import Float

from skillcrew.envs.bridges import gymnasium_spaces as spaces
from skillcrew.envs.bridges.gymnasium_config import GymnasiumConfig
from skillcrew.envs.bridges.host_environment import HostEnvironment
from skillcrew.envs.bridges.host_world import Actions, Moved
from skillcrew.envs.importing import import_module
from skillcrew.errors import UserError, nearest_first


class GymnasiumEnvironment(HostEnvironment):
    """One of Gymnasium's environments, stepped on the host."""

    name = "gymnasium"
    config_class = GymnasiumConfig

    def __init__(self, config: GymnasiumConfig):
        foreign = config.foreign_code()
        if module := config.imports():
            import_module(module, f"gymnasium:{config.id}", here=foreign is not None)
        super().__init__(config, lambda: GymnasiumWorld(config.id, config.arguments))


class GymnasiumWorld:
    """One of them.

    Raises:
        UserError: unknown, refuses its arguments, or has spaces that do not fit.
    """

    def __init__(self, name: str, arguments: Mapping[str, Any]):
        self.env = _made(name, arguments)
        self._seen, self._done = self.env.observation_space, self.env.action_space
        self.agents = [spaces.agent("agent", self._seen, self._done)]
        self.max_steps = None if self.env.spec is None else self.env.spec.max_episode_steps

    def reset(self, seed: int) -> Float[np.ndarray, " numbers"]:
        return spaces.flat(self._seen, self.env.reset(seed=seed)[0])

    def step(self, action: Actions) -> Moved:
        observation, reward, terminated, truncated, _ = self.env.step(spaces.native(self._done, action))
        rewards = np.array([reward], np.float32)
        seen = spaces.flat(self._seen, observation)
        return Moved(seen, rewards, bool(terminated), bool(truncated and not terminated))


def _made(name: str, arguments: Mapping[str, Any]) -> gymnasium.Env:
    plain = name.rpartition(":")[2]
    if plain not in gymnasium.registry:
        near = ", ".join(nearest_first(plain, gymnasium.registry)[:5])
        raise UserError(f"gymnasium:{name}: Gymnasium knows no {plain}; nearest: {near}")
    try:
        # What the checker looks for is what PettingZoo and Gymnasium tell the world's author.
        return gymnasium.make(plain, disable_env_checker=True, **arguments)
    except Exception as error:
        raise made_badly(f"gymnasium:{name}", arguments, error) from error


def made_badly(name: str, arguments: Mapping[str, Any], error: Exception) -> UserError:
    """The line for a world that could not be made."""
    given = f" with {', '.join(f'{key}={value}' for key, value in arguments.items())}" if arguments else ""
    said = str(error).splitlines()[0] if str(error) else ""
    return UserError(f"{name} cannot be made{given}: {type(error).__name__}: {said}")
