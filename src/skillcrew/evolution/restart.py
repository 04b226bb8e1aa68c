"""When a search that is stuck begins anew, and what is kept of the one that was given up."""

import dataclasses

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from skillcrew.errors import UserError

LOW = 0.8
"""What `RestartConfig.below` is where an environment says what success is."""

NEVER = -(2**30)
"""Generations waited by a search that is never to begin anew."""

ROUNDING = 1e-6
"""Share of its own size by which a fitness that did not change may differ, for it is an average."""


@dataclasses.dataclass(frozen=True)
class RestartConfig:
    """When a search begins anew from random teams.

    The best that was given up stays the champion until the new search surpasses it.
    """

    patience: int = 0
    """Generations without improvement of the fitness after which it does; 0 for never."""
    below: float | None = None
    """Fitness from which on it never does, however slowly it improves. Default: 0.8 where the environment
    says what success is; elsewhere no fitness is known to be low, and only who never improved begins anew."""
    tolerance: float = 0.01
    """What counts as improvement: a difference in fitness or, where no `below` is known, a share of the
    difference between the best and the worst of a generation."""

    def __post_init__(self) -> None:
        if self.patience < 0:
            raise UserError(f"restart.patience = {self.patience}: give generations, or 0 for no restarts")
        if self.below is not None and self.below != self.below:
            raise UserError(f"restart.below = {self.below}: give a fitness, such as 0.4")
        if not self.tolerance >= 0:
            raise UserError(f"restart.tolerance = {self.tolerance}: give a number of at least 0")

    @property
    def floor(self) -> float:
        """What a search is worth that was told nothing yet.

        A level from 0 up is one on a scale of successes, which count from 0; any other scale has no least
        fitness.
        """
        return 0.0 if self.below is not None and self.below >= 0 else -float("inf")


class Progress(eqx.Module):
    """How far a search has come since it began (anew), and the best that was given up."""

    fitness: Float[Array, ""]
    """As it was last told; the floor before."""
    peak: Float[Array, ""]
    """Its highest value since the search began (anew), but for what the tolerance swallowed."""
    waited: Int[Array, ""]
    """Generations since then; below 0 if the search is never to begin anew."""
    kept: Float[Array, " genes"]
    """The best genome that was given up."""
    kept_fitness: Float[Array, ""]
    """What was known of its fitness; minus infinity if none was given up."""

    @classmethod
    def create(cls, genome: Float[Array, " genes"], config: RestartConfig) -> "Progress":
        """Of a search that begins; the genome stands for none."""
        floor = jnp.full((), config.floor, jnp.float32)
        return cls(floor, floor, jnp.zeros((), jnp.int32), genome, jnp.full((), -jnp.inf, jnp.float32))

    def observe(
        self, fitness: Float[Array, ""], spread: Float[Array, ""], config: RestartConfig
    ) -> "Progress":
        """Takes in what one generation says of the search's fitness.

        Args:
            spread: the difference between its best and its worst individual.
        """
        if config.below is None:
            return self._observe_without_a_level(fitness, spread, config.tolerance)
        improved = fitness > self.peak + config.tolerance
        waited = jnp.where(improved, 0, self.waited + 1)
        # A fitness below the floor is not on the scale that the level is on.
        settled = (self.waited < 0) | (fitness < config.floor)
        return dataclasses.replace(
            self,
            fitness=fitness,
            peak=jnp.where(improved, fitness, self.peak),
            waited=jnp.where(settled, NEVER, waited),
        )

    def _observe_without_a_level(
        self, fitness: Float[Array, ""], spread: Float[Array, ""], tolerance: float
    ) -> "Progress":
        """The first fitness is what the search began with; whoever improves on it never begins anew."""
        is_first = self.peak == -jnp.inf
        began = jnp.where(is_first, fitness, self.peak)
        improved = fitness > began + tolerance * spread + ROUNDING * jnp.abs(began)
        waited = jnp.where(is_first, 0, self.waited + 1)
        return dataclasses.replace(
            self,
            fitness=fitness,
            peak=jnp.where(improved, fitness, began),
            waited=jnp.where(improved | (self.waited < 0), NEVER, waited),
        )

    def stalled(self, config: RestartConfig) -> Bool[Array, ""]:
        """Whether the search is to begin anew."""
        if not config.patience:
            return jnp.zeros((), bool)
        below = jnp.inf if config.below is None else config.below
        return (self.waited >= config.patience) & (self.fitness < below)

    def begin_anew(self, champion: Float[Array, " genes"], config: RestartConfig) -> "Progress":
        """Of the search that takes this one's place; its champion is kept if it is the best so far."""
        better = self.fitness > self.kept_fitness
        return dataclasses.replace(
            Progress.create(jnp.where(better, champion, self.kept), config),
            kept_fitness=jnp.where(better, self.fitness, self.kept_fitness),
        )

    @property
    def outdone(self) -> Bool[Array, ""]:
        """Whether the present search has not surpassed the one that was given up yet."""
        return self.kept_fitness > self.fitness

    def champion(self, current: Float[Array, " genes"]) -> Float[Array, " genes"]:
        """The present search's champion, or the one that was given up and is not surpassed yet."""
        return jnp.where(self.outdone, self.kept, current)
