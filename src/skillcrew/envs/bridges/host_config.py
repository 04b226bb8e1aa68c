"""Options of a world that is stepped on the host, in Python and not in JAX."""

import abc
import dataclasses
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from skillcrew.envs.importing import import_object, import_path
from skillcrew.errors import UserError

Argument = bool | int | float | str | None
SkillReward = Callable[[Any, Any, Any, Any], Any]
"""(observation, action, next_observation, reward) -> one number, of one agent, in jax.numpy."""

TRUSTED = ("gymnasium", "mpe2", "pettingzoo")
"""Packages whose modules a run folder may name without being trusted."""


@dataclasses.dataclass(frozen=True)
class HostConfig(abc.ABC):
    """What worlds of both libraries have in common."""

    arguments: Mapping[str, Argument] = dataclasses.field(default_factory=dict)
    """What the world itself is made with, such as N=3,continuous_actions=true."""
    episode_length: int | None = None
    """Steps after which an episode is cut off; none for the world's own limit, where it says one."""
    skills: Mapping[str, SkillReward | str] = dataclasses.field(default_factory=dict)
    """Functions of one agent's (observation, action, next_observation, reward), in jax.numpy, or their import
    paths, such as near=mylab.skills:near; none for one skill, "reward", which is the agent's own reward."""

    def __post_init__(self) -> None:
        if self.episode_length is not None and self.episode_length < 1:
            raise UserError(f"episode_length = {self.episode_length}: give at least 1")
        for name, reward in self.skills.items():
            if not (callable(reward) or (isinstance(reward, str) and ":" in reward)):
                raise UserError(f"skills.{name} = {reward!r}: give a function or an import path, module:name")

    def foreign_code(self) -> str | None:
        """The first field that makes code run which is neither ours nor of a package in `TRUSTED`."""
        return next(self._foreign(), None)

    @abc.abstractmethod
    def imports(self) -> str:
        """The module that is imported to make the world; empty where it is the library alone."""

    @abc.abstractmethod
    def called(self) -> str:
        """What the environment is called, in files and figures."""

    def _foreign(self) -> Iterator[str]:
        module = self.imports()
        if module and module.partition(".")[0] not in TRUSTED:
            yield f"module {module}"
        for name, reward in self.skills.items():
            yield f"skills.{name} = {path_of(reward)}"

    def plain(self) -> dict[str, Any]:
        """All fields as plain values; functions by their import paths."""
        fields = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        skills = {name: path_of(reward) for name, reward in self.skills.items()}
        return {**fields, "arguments": dict(self.arguments), "skills": skills}

    def skill_rewards(self) -> dict[str, SkillReward]:
        """The functions themselves.

        Raises:
            UserError: an import path at which there is none.
        """
        return {name: reward_function(name, reward) for name, reward in self.skills.items()}


def path_of(reward: Callable[..., Any] | str) -> str:
    """The import path of what a skill is paid by."""
    return reward if isinstance(reward, str) else import_path(reward)


def reward_function(name: str, reward: Callable[..., Any] | str) -> Callable[..., Any]:
    """What a skill is paid by, imported where it is named by its path.

    Raises:
        UserError: an import path at which there is no function.
    """
    if not isinstance(reward, str):
        return reward
    if reward.startswith("__main__:") or "<" in reward:
        raise UserError(
            f"skills.{name} = {reward}: cannot be imported from there; give the environment itself, "
            "skillcrew.Run(folder, env), or move the function to a module"
        )
    found = import_object(reward)
    if not callable(found):
        raise UserError(f"skills.{name} = {reward}: {type(found).__name__}, and no function")
    return found
