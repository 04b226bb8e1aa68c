"""Who may act next: an upper confidence bound over learners (CERL; Khadka et al. 2019, section 3)."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, Key

from skillcrew.errors import UserError


@dataclasses.dataclass(frozen=True)
class ResourceConfig:
    """How rollouts are handed out among learners."""

    exploration: float = 0.9
    """Weight c of what is not known yet, beside the value (CERL)."""
    memory: float = 0.8
    """Share of its old value that a learner keeps when one more episode of it is known (CERL)."""
    gap: float = 0.1
    """Differences in value that sum up to well below this, in units of return, are taken for noise."""

    def __post_init__(self) -> None:
        if not self.exploration > 0:
            raise UserError(
                f"resources.exploration = {self.exploration}: give a positive number, or a learner that "
                "began badly would never act again"
            )
        if not 0 <= self.memory < 1:
            raise UserError(f"resources.memory = {self.memory}: give a share from 0 to below 1")
        if not self.gap > 0:
            raise UserError(f"resources.gap = {self.gap}: give a positive number")


class ResourceManager(eqx.Module):
    """What is known of each learner, and who acts in which slot of the next generation."""

    value: Float[Array, " learners"]
    """Mean return of a learner's own episodes, recent ones counting more."""
    visits: Int[Array, " learners"]
    """Episodes that it has acted in."""
    allotted: Int[Array, " slots"]
    """The learner that acts in each slot next."""

    @classmethod
    def create(cls, learners: int, slots: int) -> "ResourceManager":
        """Nothing is known; the slots go round."""
        unknown = jnp.zeros(learners)
        return cls(unknown, jnp.zeros(learners, jnp.int32), jnp.arange(slots, dtype=jnp.int32) % learners)

    def probabilities(self, config: ResourceConfig) -> Float[Array, " learners"]:
        """Each learner's chance of a slot: its share of the upper confidence bounds.

        U_i = v_i + c √(ln Σ_j n_j / n_i), where v is the value above the worst one, normalised, and n the
        visits. Slots are drawn by these shares, not given to the largest, so that all go on acting.
        """
        above = self.value - self.value.min()
        visits = jnp.maximum(self.visits, 1).astype(jnp.float32)
        unknown = jnp.sqrt(jnp.log(visits.sum()) / visits)
        bound = above / (above.sum() + config.gap) + config.exploration * unknown
        return bound / bound.sum()

    def observe(
        self, key: Key[Array, ""], returns: Float[Array, " slots"], config: ResourceConfig
    ) -> "ResourceManager":
        """Takes in how the slots went, and allots those of the next generation.

        Args:
            returns: of the episode in each slot, in their order.
        """

        def one(known, slot):
            value, visits = known
            learner, gained = slot
            keep = jnp.where(visits[learner] > 0, config.memory, 0.0)
            value = value.at[learner].set(keep * value[learner] + (1 - keep) * gained)
            return (value, visits.at[learner].add(1)), None

        (value, visits), _ = jax.lax.scan(one, (self.value, self.visits), (self.allotted, returns))
        known = ResourceManager(value, visits, self.allotted)
        chance = known.probabilities(config)
        allotted = jax.random.choice(key, chance.shape[0], self.allotted.shape, p=chance)
        return dataclasses.replace(known, allotted=allotted.astype(jnp.int32))
