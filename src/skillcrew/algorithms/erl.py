"""ERL: Evolutionary Reinforcement Learning (Khadka and Tumer 2018; thesis, section 2.1.10).

A population of actors evolves on the team reward and fills a buffer; one actor learns by gradient from
that buffer and from noisy episodes of its own; now and then it migrates into the population.
"""

import dataclasses
from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Key

from skillcrew.algorithms.actor_learning import ActorLearning
from skillcrew.algorithms.algorithm import ActsDirectly, override
from skillcrew.algorithms.migration import Migration, MigrationConfig, MigrationState
from skillcrew.envs.environment import Environment
from skillcrew.envs.joint import Joint
from skillcrew.policies.team import JointTeam


@dataclasses.dataclass(frozen=True)
class ERLConfig(MigrationConfig):
    """Options of ERL."""


class ERL(ActsDirectly):
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
        joint = Joint(env)
        self._migration = Migration(joint, self.config, ActorLearning(joint, self.config), networks=1)

    def init(self, key: Key[Array, ""]) -> MigrationState:
        """Random actors, an empty buffer."""
        return self._migration.init(key)

    def step(self, state: MigrationState) -> tuple[MigrationState, dict[str, Array]]:
        """One generation; the one learner lives all noisy episodes."""
        explorer = jnp.zeros(self.config.learner_episodes, jnp.int32)
        state, metrics, _ = self._migration.generation(state, explorer)
        return state, metrics

    def team(self, state: MigrationState) -> JointTeam:
        """The champion of the population."""
        return JointTeam(self._migration.champion(state), self.env.n_agents)

    def transient_bytes(self) -> int:
        """What a generation takes beside the state."""
        return self._migration.transient_bytes()
