"""When a search that is stuck begins anew, and what is kept of the one that was given up."""

import dataclasses

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from skillcrew.errors import UserError


@dataclasses.dataclass(frozen=True)
class RestartConfig:
    """When a search begins anew from random teams.

    The best that was given up stays the champion until the new search surpasses it.
    """

    patience: int = 0
    """Generations without improvement of the fitness after which it does; 0 for never."""
    below: float = 0.4
    """Fitness from which on it never does, however slowly it improves."""
    tolerance: float = 0.01
    """What counts as improvement."""

    def __post_init__(self) -> None:
        if self.patience < 0:
            raise UserError(f"restart.patience = {self.patience}: give generations, or 0 for no restarts")
        if self.below != self.below:
            raise UserError(f"restart.below = {self.below}: give a fitness, such as 0.4")
        if not self.tolerance >= 0:
            raise UserError(f"restart.tolerance = {self.tolerance}: give a number of at least 0")


class Progress(eqx.Module):
    """How far a search has come since it began (anew), and the best that was given up."""

    fitness: Float[Array, ""]
    """As it was last told."""
    peak: Float[Array, ""]
    """Its highest value since the search began (anew)."""
    waited: Int[Array, ""]
    """Generations since then."""
    kept: Float[Array, " genes"]
    """The best genome that was given up."""
    kept_fitness: Float[Array, ""]
    """What was known of its fitness; minus infinity if none was given up."""

    @classmethod
    def create(cls, genome: Float[Array, " genes"]) -> "Progress":
        """Of a search that begins; the genome stands for none."""
        return cls(jnp.zeros(()), jnp.zeros(()), jnp.zeros((), jnp.int32), genome, jnp.full((), -jnp.inf))

    def observe(self, fitness: Float[Array, ""], config: RestartConfig) -> "Progress":
        """Takes in what one generation says of the search's fitness."""
        improved = fitness > self.peak + config.tolerance
        return dataclasses.replace(
            self,
            fitness=fitness,
            peak=jnp.where(improved, fitness, self.peak),
            waited=jnp.where(improved, 0, self.waited + 1),
        )

    def stalled(self, config: RestartConfig) -> Bool[Array, ""]:
        """Whether the search is to begin anew."""
        if not config.patience:
            return jnp.zeros((), bool)
        return (self.waited >= config.patience) & (self.fitness < config.below)

    def begin_anew(self, champion: Float[Array, " genes"]) -> "Progress":
        """Of the search that takes this one's place; its champion is kept if it is the best so far."""
        better = self.fitness > self.kept_fitness
        return dataclasses.replace(
            Progress.create(jnp.where(better, champion, self.kept)),
            kept_fitness=jnp.where(better, self.fitness, self.kept_fitness),
        )

    @property
    def outdone(self) -> Bool[Array, ""]:
        """Whether the present search has not surpassed the one that was given up yet."""
        return self.kept_fitness > self.fitness

    def champion(self, current: Float[Array, " genes"]) -> Float[Array, " genes"]:
        """The present search's champion, or the one that was given up and is not surpassed yet."""
        return jnp.where(self.outdone, self.kept, current)
