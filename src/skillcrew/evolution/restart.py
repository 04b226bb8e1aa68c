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

HALF = 0.5
"""Share of the individuals that get the least from which on a generation counts as one that gets nothing."""

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
    """Fitness from which on it never does, however slowly it improves. Default: 0.8, of 1 for a success,
    where the environment says what that is; elsewhere only who never improved, or gets nothing, does."""
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
    risen: Bool[Array, ""]
    """Whether it has ever been better than it began."""
    idle: Int[Array, ""]
    """Of the generations waited, those in which half of the individuals got no more than `least`."""
    least: Float[Array, ""]
    """The lowest fitness that any individual of this search, or of those given up, was ever told."""
    most: Float[Array, ""]
    """The highest."""
    kept: Float[Array, " genes"]
    """The best genome that was given up."""
    kept_fitness: Float[Array, ""]
    """What was known of its fitness; minus infinity if none was given up."""

    @classmethod
    def create(cls, genome: Float[Array, " genes"], config: RestartConfig) -> "Progress":
        """Of a search that begins; the genome stands for none."""
        floor, infinity = jnp.full((), config.floor, jnp.float32), jnp.full((), jnp.inf, jnp.float32)
        never, none = jnp.zeros((), bool), jnp.zeros((), jnp.int32)
        return cls(floor, floor, none, never, none, infinity, -infinity, genome, -infinity)

    def observe(
        self, fitness: Float[Array, ""], of_all: Float[Array, " population"], config: RestartConfig
    ) -> "Progress":
        """Takes in what one generation says of the search's fitness.

        Args:
            of_all: what its individuals were told.
        """
        # Without a level nothing is known of the first fitness but that the search began with it.
        is_first = self.peak == -jnp.inf
        peak = jnp.where(is_first, fitness, self.peak)
        tolerance = config.tolerance
        if config.below is None:
            tolerance = tolerance * jnp.ptp(of_all) + ROUNDING * jnp.abs(peak)
        improved = fitness > peak + tolerance
        waited = jnp.where(improved | is_first, 0, self.waited + 1)
        if config.below is not None:
            # A fitness below the floor is not on the scale that the level is on.
            waited = jnp.where((self.waited < 0) | (fitness < config.floor), NEVER, waited)
        least = jnp.minimum(self.least, of_all.min())
        nothing = (of_all <= least).mean() >= HALF
        return dataclasses.replace(
            self,
            fitness=fitness,
            peak=jnp.where(improved, fitness, peak),
            waited=waited,
            risen=self.risen | improved,
            idle=jnp.where(waited > 0, self.idle + nothing.astype(jnp.int32), 0),
            least=least,
            most=jnp.maximum(self.most, of_all.max()),
        )

    def stalled(self, config: RestartConfig, low: float = LOW) -> Bool[Array, ""]:
        """Whether the search is to begin anew.

        Args:
            low: where no level is known, the share of the way from the least to the most fitness that
                anybody got below which a search is low, if half of its individuals mostly get the least.
        """
        if not config.patience:
            return jnp.zeros((), bool)
        waited = self.waited >= config.patience
        if config.below is not None:
            return waited & (self.fitness < config.below)
        sparse = self.idle * 2 > self.waited
        below = self.least + low * (self.most - self.least)
        return waited & (~self.risen | (sparse & (self.fitness < below)))

    def begin_anew(self, champion: Float[Array, " genes"], config: RestartConfig) -> "Progress":
        """Of the search that takes this one's place; its champion is kept if it is the best so far."""
        better = self.fitness > self.kept_fitness
        return dataclasses.replace(
            Progress.create(jnp.where(better, champion, self.kept), config),
            least=self.least,
            most=self.most,
            kept_fitness=jnp.where(better, self.fitness, self.kept_fitness),
        )

    @property
    def outdone(self) -> Bool[Array, ""]:
        """Whether the present search has not surpassed the one that was given up yet."""
        return self.kept_fitness > self.fitness

    def champion(self, current: Float[Array, " genes"]) -> Float[Array, " genes"]:
        """The present search's champion, or the one that was given up and is not surpassed yet."""
        return jnp.where(self.outdone, self.kept, current)
