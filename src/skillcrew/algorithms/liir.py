"""LIIR: learning individual intrinsic rewards (Du et al. 2019; thesis, section 2.2.1).

One generation: the team lives `episodes` fresh episodes by policies that draw what they do. Policies take a
step up the proxy reward, the team's and a learned one of each agent. The learned rewards take one up the
team's reward that policies get after that step, by the gradient through it. Then critics follow the
returns of both rewards.
"""

import dataclasses

from skillcrew.algorithms.on_policy import OnPolicyConfig, OnPolicyTeam
from skillcrew.learners.liir import LIIR as Learner
from skillcrew.learners.liir import LIIRLearnerConfig
from skillcrew.learners.on_policy.networks import Players


@dataclasses.dataclass(frozen=True)
class LIIRConfig(OnPolicyConfig):
    """Options of LIIR."""

    liir: LIIRLearnerConfig = dataclasses.field(default_factory=LIIRLearnerConfig)
    """How policies, critics and intrinsic rewards learn."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.liir.check_episodes(self.episodes)


class LIIR(OnPolicyTeam):
    """Agents learn by policy gradient, each also on a reward that is learned for it.

    `LIIR(env, choose="skills")` overrides fields of `LIIRConfig`.

    Raises:
        UserError: an unknown field, skill or reward, or a value that a field refuses.
    """

    name = "liir"
    label = "LIIR"
    config_class = LIIRConfig

    def _make_learner(self, players: Players) -> Learner:
        return Learner(self.config.liir, players, self.config.policy, self.config.critic)
