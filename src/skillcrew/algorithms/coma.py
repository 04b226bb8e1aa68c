"""COMA: counterfactual multi-agent policy gradients (Foerster et al. 2018; thesis, section 2.2.3).

One generation: the team lives `episodes` fresh episodes by policies that draw what they do. A critic that
sees all agents follows TD(λ) targets; for each agent it gives, in one pass, the value of every choice that
the agent had while all others do what they did. An agent's advantage is the value of what it chose less
the mean of these by its own policy, and the policies climb it.
"""

import dataclasses
from typing import Literal

from skillcrew.algorithms.on_policy import OnPolicyConfig, OnPolicyTeam
from skillcrew.errors import UserError
from skillcrew.learners.coma import COMA as Learner
from skillcrew.learners.coma import COMALearnerConfig
from skillcrew.learners.on_policy.networks import Players
from skillcrew.policies.memory import PolicyConfig


@dataclasses.dataclass(frozen=True)
class COMAConfig(OnPolicyConfig):
    """Options of COMA."""

    choose: Literal["skills", "actions"] = "skills"
    """Among what agents decide: "skills", which learn beside them as in MADyS, or their primitive "actions",
    if these are discrete."""
    policy: PolicyConfig = dataclasses.field(
        default_factory=lambda: PolicyConfig(hidden=(64,), memory=64, sharing="team")
    )
    """The agents' policies; with memory, as published."""
    critic: PolicyConfig = dataclasses.field(
        default_factory=lambda: PolicyConfig(hidden=(64, 64), memory=64, sharing="team")
    )
    """The critic; with memory as policies have, since what is observed may not tell what was done before."""
    coma: COMALearnerConfig = dataclasses.field(default_factory=COMALearnerConfig)
    """How policies and the critic learn."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.coma.check_episodes(self.episodes)


class COMA(OnPolicyTeam):
    """Agents learn by policy gradient from what each one's choice changed for the team.

    `COMA(env, choose="actions")` overrides fields of `COMAConfig`.

    Raises:
        UserError: continuous actions, an unknown field, skill or reward, or a value that a field refuses.
    """

    name = "coma"
    label = "COMA"
    config_class = COMAConfig

    def _make_learner(self, players: Players) -> Learner:
        if players.options.continuous:
            raise UserError(
                f"coma: compares each choice with all others, and actions of {self.env.name} are continuous; "
                "set choose to skills, or use mappo, ippo or liir"
            )
        return Learner(self.config.coma, players, self.config.policy, self.config.critic)
