"""PettingZoo's parallel environments as teams."""

import importlib.util
import pkgutil
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from jaxtyping import Float

from skillcrew.envs.bridges import gymnasium_spaces as spaces
from skillcrew.envs.bridges.gymnasium_world import made_badly
from skillcrew.envs.bridges.host_environment import HostEnvironment
from skillcrew.envs.bridges.host_world import Actions, Moved, by_kind
from skillcrew.envs.bridges.pettingzoo_config import PettingZooConfig
from skillcrew.envs.importing import import_module
from skillcrew.errors import UserError, nearest_first


class PettingZooEnvironment(HostEnvironment):
    """One of PettingZoo's parallel environments, stepped on the host."""

    name = "pettingzoo"
    config_class = PettingZooConfig

    def __init__(self, config: PettingZooConfig):
        module = _module(config)
        super().__init__(config, lambda: PettingZooWorld(module, config.arguments))


class PettingZooWorld:
    """One of them.

    Raises:
        UserError: cannot be made, or has spaces that do not fit.
    """

    def __init__(self, module: ModuleType, arguments: Mapping[str, Any]):
        name = f"pettingzoo:{module.__name__}"
        if not hasattr(module, "parallel_env"):
            raise UserError(
                f"{name} has no parallel_env, which would make a world whose agents all act at once"
            )
        try:
            self.env = module.parallel_env(**arguments)
            names = list(self.env.possible_agents)
        except Exception as error:
            raise made_badly(name, arguments, error) from error
        self._ids = {str(name): name for name in names}
        self._seen = {name: self.env.observation_space(one) for name, one in self._ids.items()}
        self._done = {name: self.env.action_space(one) for name, one in self._ids.items()}
        agents = [spaces.agent(name, self._seen[name], self._done[name]) for name in self._ids]
        self.agents = [agent for kind in by_kind(agents).values() for agent in kind]
        limit = getattr(self.env.unwrapped, "max_cycles", None)
        self.max_steps = limit if isinstance(limit, int) else None

    def reset(self, seed: int) -> Float[np.ndarray, " numbers"]:
        self._shown = {agent.name: np.zeros(agent.observation_size, np.float32) for agent in self.agents}
        self._cut = False
        self._see(self.env.reset(seed=seed)[0])
        return self._row()

    def step(self, action: Actions) -> Moved:
        acting = set(self.env.agents)
        actions, rest = {}, action
        for agent in self.agents:
            numbers, rest = rest[: agent.numbers], rest[agent.numbers :]
            if (one := self._ids[agent.name]) in acting:
                actions[one] = spaces.native(self._done[agent.name], numbers)
        observations, rewards, terminated, truncated, _ = self.env.step(actions)
        self._see(observations)
        self._cut |= any(truncated[one] and not terminated[one] for one in acting)
        paid = np.array([rewards.get(self._ids[agent.name], 0.0) for agent in self.agents], np.float32)
        over = not self.env.agents
        return Moved(self._row(), paid, over and not self._cut, over and self._cut)

    def _see(self, observations: Mapping[Any, Any]) -> None:
        for name, one in self._ids.items():
            if one in observations:
                self._shown[name] = spaces.flat(self._seen[name], observations[one])

    def _row(self) -> Float[np.ndarray, " numbers"]:
        return np.concatenate([self._shown[agent.name] for agent in self.agents])


def _module(config: PettingZooConfig) -> ModuleType:
    name = config.module
    try:
        return import_module(name, f"pettingzoo:{name}", here=config.foreign_code() is not None)
    except UserError as error:
        if "importing it fails" in str(error):
            raise
        near = ", ".join(nearest_first(name, _installed())[:5])
        raise UserError(f"pettingzoo:{name}: no module {name} is installed; nearest: {near}") from error


def _installed() -> Iterator[str]:
    """Modules of worlds in PettingZoo's own packages, without importing them."""
    for package in ("mpe2", "pettingzoo"):
        spec = importlib.util.find_spec(package)
        for folder in (spec.submodule_search_locations or []) if spec else []:
            inner = (
                [path.name for path in Path(folder).iterdir() if path.is_dir()] if package != "mpe2" else []
            )
            for place, root in (
                (folder, package),
                *((f"{folder}/{one}", f"{package}.{one}") for one in inner),
            ):
                for module in pkgutil.iter_modules([place]):
                    if "_v" in module.name and module.name.rpartition("_v")[2].isdigit():
                        yield f"{root}.{module.name}"
