"""Which of JaxMARL's environments, and how it becomes a task of ours."""

import dataclasses
import re
from collections.abc import Callable, Mapping
from typing import Any, Literal

import yaml

from skillcrew.envs.bridges.host_config import path_of
from skillcrew.errors import UserError

Skills = Mapping[str, Callable[..., Any] | str]
"""Functions, or their import paths, by the skill's name."""
Options = Mapping[str, Any]


@dataclasses.dataclass(frozen=True)
class JaxMARLConfig:
    """An environment of JaxMARL as a task: its options, what the team is paid, and what can be learned.

    Raises:
        UserError: a value out of range, or options that no file can hold.
    """

    env_id: str = "MPE_simple_spread_v3"
    """What `jaxmarl.make` calls the environment."""
    options: Options = dataclasses.field(default_factory=dict)
    """Further arguments of `jaxmarl.make`, plain values: num_agents=2,action_type=Continuous.
    Layouts of Overcooked and scenarios of SMAX go by their names."""
    episode_length: int | None = None
    """Steps after which an episode is truncated; none for the environment's own limit."""
    team_reward: Literal["mean", "sum", "first"] = "mean"
    """The team's reward, of the agents' rewards: their mean, their sum, or the first agent's."""
    skills: Skills = dataclasses.field(default_factory=dict)
    """Local rewards by skill, such as near=mylab.skills:near or near=skills.py:near; none for one skill,
    "own_reward": what JaxMARL pays the agent."""

    def __post_init__(self) -> None:
        length = self.episode_length
        if length is not None and (isinstance(length, bool) or length < 1):
            raise UserError(f"episode_length = {length}: give at least 1, or none")
        if self.team_reward not in ("mean", "sum", "first"):
            raise UserError(f"team_reward = {self.team_reward}: give mean, sum or first")
        for name, value in self.options.items():
            _check_plain(name, value)

    def foreign_code(self) -> str | None:
        """The first field that makes code run which is neither ours nor JaxMARL's."""
        return next((f"skills.{name} = {path_of(reward)}" for name, reward in self.skills.items()), None)

    def called(self) -> str:
        """What files and figures call it: its name after `jaxmarl-`, without what no file can be called."""
        return "jaxmarl-" + re.sub(r"[^\w.-]", "-", self.env_id)


def _check_plain(name: str, value: Any) -> None:
    try:
        yaml.safe_dump(value)
    except yaml.YAMLError:
        kind = type(value).__name__
        raise UserError(
            f"options: {name} is a {kind}, which a run's folder cannot hold; give numbers, words and lists"
        ) from None
