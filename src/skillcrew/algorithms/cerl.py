"""CERL: Collaborative Evolutionary Reinforcement Learning (Khadka et al. 2019; thesis, section 2.1.10).

As ERL, with a portfolio of learners that look ahead over different horizons. All learn from one buffer; a
resource manager hands out the noisy episodes to those which do well or are little known; all migrate.
"""

import dataclasses
from typing import Any

import equinox as eqx
import jax
from jaxtyping import Array, Key

from skillcrew.algorithms.actor_learning import ActorLearning
from skillcrew.algorithms.algorithm import ActsDirectly, override
from skillcrew.algorithms.migration import Migration, MigrationConfig, MigrationState
from skillcrew.envs.environment import Environment
from skillcrew.envs.joint import Joint
from skillcrew.envs.padded import uniform
from skillcrew.errors import UserError
from skillcrew.learners.resource_manager import ResourceConfig, ResourceManager
from skillcrew.policies.team import JointTeam


@dataclasses.dataclass(frozen=True)
class CERLConfig(MigrationConfig):
    """Options of CERL."""

    discounts: tuple[float, ...] = (0.9, 0.99, 0.997, 0.9995)
    """Discount per step of each learner of the portfolio (CERL); `learner.discount` means nothing here."""
    resources: ResourceConfig = dataclasses.field(default_factory=ResourceConfig)
    """How noisy episodes are handed out among the learners."""
    learner_episodes: int = 10
    """Noisy episodes per generation (CERL: 10), at least one for each learner."""
    migration_period: int = 5
    """Generations between two migrations of all learners into the population (CERL)."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.discounts) < 2:
            raise UserError(
                f"discounts = {self.discounts}: a portfolio of {len(self.discounts)} leaves the resource "
                "manager nothing to choose; give at least 2, or use erl"
            )
        for discount in self.discounts:
            if not 0 <= discount < 1:
                raise UserError(f"discounts = {self.discounts}: give numbers from 0 to below 1")
        if self.learner_episodes < len(self.discounts):
            raise UserError(
                f"learner_episodes = {self.learner_episodes}: fewer than the {len(self.discounts)} learners "
                "of discounts; give each at least one"
            )


class CERLState(eqx.Module):
    """All that goes from one generation to the next."""

    lived: MigrationState
    manager: ResourceManager


class CERL(ActsDirectly):
    """A population of actors for the whole team evolves, and a portfolio of learners migrates into it.

    An actor sees all agents' observations and moves all of them. `CERL(env, discounts=(0.9, 0.99))` overrides
    fields of `CERLConfig`.

    Raises:
        UserError: an unknown field or reward, or a value that a field refuses.
    """

    name = "cerl"
    label = "CERL"
    config_class = CERLConfig

    def __init__(self, env: Environment, config: CERLConfig | None = None, **overrides: Any):
        self.env = env
        self.config = override(self, config, overrides)
        joint = Joint(uniform(env))
        portfolio = ActorLearning(joint, self.config, discounts=self.config.discounts)
        self._migration = Migration(joint, self.config, portfolio, networks=1)

    def init(self, key: Key[Array, ""]) -> CERLState:
        """Random actors, an empty buffer, and learners of which nothing is known."""
        manager = ResourceManager.create(self._migration.learners, self.config.learner_episodes)
        return CERLState(self._migration.init(key), manager)

    def step(self, state: CERLState) -> tuple[CERLState, dict[str, Array]]:
        """One generation, and who acts in the noisy episodes of the next."""
        key_lived, key_manager = jax.random.split(state.lived.key)
        lived = dataclasses.replace(state.lived, key=key_lived)
        lived, metrics, returns = self._migration.generation(lived, state.manager.allotted)
        manager = state.manager.observe(key_manager, returns, self.config.resources)
        for index, discount in enumerate(self.config.discounts):
            metrics[f"episodes_{discount}"] = manager.visits[index]
            metrics[f"value_{discount}"] = manager.value[index]
        return CERLState(lived, manager), metrics

    def team(self, state: CERLState) -> JointTeam:
        """The champion of the population."""
        return JointTeam(self._migration.champion(state.lived), self.env.n_agents)

    def transient_bytes(self) -> int:
        """What a generation takes beside the state."""
        return self._migration.transient_bytes()
