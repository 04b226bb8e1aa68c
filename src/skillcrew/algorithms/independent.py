"""TD3, DDPG and DQN on their own: agents that learn side by side, each as if the others were the world."""

import dataclasses
from typing import Any

from skillcrew.algorithms.actor_learning import ActorLearningConfig
from skillcrew.algorithms.learning_alone import LearningAlone, LearningAloneConfig
from skillcrew.errors import UserError
from skillcrew.learners.td3 import TD3Config


@dataclasses.dataclass(frozen=True)
class IndependentTD3Config(LearningAloneConfig, ActorLearningConfig):
    """Options of independent learners."""

    def __post_init__(self) -> None:
        LearningAloneConfig.__post_init__(self)
        ActorLearningConfig.__post_init__(self)


@dataclasses.dataclass(frozen=True)
class IndependentDDPGConfig(IndependentTD3Config):
    """Options of independent learners, with DDPG's: one critic, no delay, no target noise."""

    learner: TD3Config = dataclasses.field(default_factory=lambda: TD3Config.ddpg(discount=0.99))
    """How actors learn."""


class IndependentTD3(LearningAlone):
    """Each agent learns by TD3 on a reward of its own or the team's; nothing evolves.

    `IndependentTD3(env, reward="local")` overrides fields of `IndependentTD3Config`.

    Raises:
        UserError: an unknown field or reward, or a value that a field refuses.
    """

    name = "td3"
    label = "TD3"
    config_class: Any = IndependentTD3Config

    def _check_actions(self) -> None:
        if self.env.choices:
            raise UserError(
                f"{self.name}: gives continuous actions, and those of {self.env.name} are discrete; use dqn, "
                "maddpg, matd3, madys, madys-plus, mfl, ea, ccea, merl, erl or cerl"
            )


class IndependentDDPG(IndependentTD3):
    """Each agent learns by DDPG on a reward of its own or the team's; nothing evolves."""

    name = "ddpg"
    label = "DDPG"
    config_class = IndependentDDPGConfig


class IndependentDQN(IndependentTD3):
    """Each agent learns by DQN on a reward of its own or the team's; for discrete actions."""

    name = "dqn"
    label = "DQN"

    def _check_actions(self) -> None:
        if not self.env.choices:
            raise UserError(
                f"dqn: picks one of several actions, and those of {self.env.name} are continuous; use td3, "
                "ddpg, maddpg or matd3"
            )
