"""IPPO and MAPPO: agents that learn side by side by proximal policy optimisation.

One generation: the team lives `episodes` fresh episodes by policies that draw what they do; advantages
are estimated from critics' values (Schulman et al. 2016); then, several times over, policies climb the
clipped objective and critics follow the returns (Schulman et al. 2017). IPPO's critics see what their
agent sees (de Witt et al. 2020), MAPPO's what all agents see (Yu et al. 2022).
"""

import dataclasses

from skillcrew.algorithms.on_policy import OnPolicyConfig, OnPolicyTeam
from skillcrew.learners.on_policy.networks import Players, View
from skillcrew.learners.ppo import PPO, PPOConfig


@dataclasses.dataclass(frozen=True)
class MAPPOConfig(OnPolicyConfig):
    """Options of IPPO and MAPPO."""

    ppo: PPOConfig = dataclasses.field(default_factory=PPOConfig)
    """How policies and critics learn."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.ppo.check_episodes(self.episodes)


class MAPPO(OnPolicyTeam):
    """Agents learn by PPO on the team's reward or one of their own; critics see what all agents see.

    `MAPPO(env, choose="skills")` overrides fields of `MAPPOConfig`.

    Raises:
        UserError: an unknown field, skill or reward, or a value that a field refuses.
    """

    name = "mappo"
    label = "MAPPO"
    config_class = MAPPOConfig
    view: View = "joint"

    def _make_learner(self, players: Players) -> PPO:
        return PPO(self.config.ppo, players, self.config.policy, self.config.critic, self.view)


class IPPO(MAPPO):
    """Agents learn by PPO, each with a critic that sees only what the agent itself sees.

    `IPPO(env, choose="skills")` overrides fields of `MAPPOConfig`.

    Raises:
        UserError: an unknown field, skill or reward, or a value that a field refuses.
    """

    name = "ippo"
    label = "IPPO"
    view: View = "own"
