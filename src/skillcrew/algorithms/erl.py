"""ERL: Evolutionary Reinforcement Learning (Khadka and Tumer 2018; thesis, section 2.1.10).

A population of actors evolves on the team reward and fills a buffer; one actor learns by gradient from
that buffer and from noisy episodes of its own; now and then it migrates into the population.
"""

import dataclasses
from typing import Any

from skillcrew.algorithms.actor_learning import ActorLearning
from skillcrew.algorithms.algorithm import override
from skillcrew.algorithms.migration import Migration, MigrationConfig, MigrationState, OneLearnerMigrates
from skillcrew.envs.environment import Environment
from skillcrew.envs.joint import Joint
from skillcrew.envs.padded import uniform
from skillcrew.policies.team import JointTeam


@dataclasses.dataclass(frozen=True)
class ERLConfig(MigrationConfig):
    """Options of ERL."""


class ERL(OneLearnerMigrates):
    """A population of actors for the whole team evolves, and one that learns by gradient migrates into it.

    An actor sees all agents' observations and moves all of them. `ERL(env, population=10)` overrides fields
    of `ERLConfig`.

    Raises:
        UserError: an unknown field or reward, or a value that a field refuses.
    """

    name = "erl"
    label = "ERL"
    config_class = ERLConfig

    def __init__(self, env: Environment, config: ERLConfig | None = None, **overrides: Any):
        self.env = env
        self.config = override(self, config, overrides)
        joint = Joint(uniform(env))
        self._migration = Migration(joint, self.config, ActorLearning(joint, self.config), networks=1)

    def team(self, state: MigrationState) -> JointTeam:
        """The champion of the population."""
        return JointTeam(self._migration.champion(state), self.env.n_agents)
