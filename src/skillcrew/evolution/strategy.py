"""An evolution strategy: the mean of a cloud of genomes climbs the fitness that the cloud measures.

Salimans et al. 2017, with mirrored sampling, ranks in place of fitness, and Adam. Where a genetic
algorithm has to find out which individual is good, which takes many episodes each, every episode
here says something about the one mean.
"""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import optax
from jaxtyping import Array, Float, Key

from skillcrew.errors import UserError
from skillcrew.evolution.evolver import Draw
from skillcrew.evolution.restart import Progress, RestartConfig

LOW_AVERAGE = 0.4
"""What `StrategyConfig.restart_below` is where an environment says what success is."""


@dataclasses.dataclass(frozen=True)
class StrategyConfig:
    """How the mean of the population moves."""

    deviation: float = 0.1
    """Standard deviation σ of individuals around the mean, of every gene."""
    learning_rate: float = 0.03
    """Adam's step size for the mean."""
    fitness_memory: float = 10.0
    """Generations that the running average of the population's fitness remembers."""
    patience: int = 40
    """Generations without improvement of that average after which the search begins anew from random
    teams; 0 for never. The best that was given up stays the champion until the new search surpasses it."""
    restart_below: float | None = None
    """Average fitness from which on it never does, however slowly it improves. Default: 0.4 where the
    environment says what success is; elsewhere see `RestartConfig.below`."""
    tolerance: float = 0.01
    """What counts as improvement: a difference in fitness or, where no `restart_below` is known, a share of
    the difference between the best and the worst of a generation."""

    def __post_init__(self) -> None:
        for field in ("deviation", "learning_rate"):
            if not getattr(self, field) > 0:
                raise UserError(f"strategy.{field} = {getattr(self, field)}: give a positive number")
        if not self.fitness_memory >= 1:
            raise UserError(f"strategy.fitness_memory = {self.fitness_memory}: give at least 1 generation")
        if self.patience < 0:
            raise UserError(f"strategy.patience = {self.patience}: give generations, or 0 for no restarts")
        if not self.tolerance >= 0:
            raise UserError(f"strategy.tolerance = {self.tolerance}: give a number of at least 0")

    @property
    def restart(self) -> RestartConfig:
        """The same three, as a search's `Progress` takes them."""
        return RestartConfig(self.patience, self.restart_below, self.tolerance)

    def check_population(self, population: int) -> None:
        """Raises `UserError` if a population of this size cannot be mirrored pairs."""
        if population < 2 or population % 2:
            raise UserError(
                f"population = {population}: an evolution strategy samples mirrored pairs; give an even "
                "number of at least 2"
            )


class StrategyState(eqx.Module):
    """The mean, its optimiser, and the cloud around it that is to be evaluated next."""

    mean: Float[Array, " genes"]
    optimiser: optax.OptState
    noise: Float[Array, "pairs genes"]
    """In standard deviations, of one of each mirrored pair."""
    evaluations: Float[Array, ""]
    """Generations that the running average of the population's mean fitness stands for."""
    progress: Progress
    """Of that average, and the best mean that was given up."""


class EvolutionStrategy:
    """An `Evolver` whose champion is the mean, which no noise of its own evaluation selects."""

    def __init__(self, config: StrategyConfig, draw: Draw):
        self.config = config
        self._draw = draw
        self._optimiser = optax.adam(config.learning_rate)

    def init(self, key: Key[Array, ""], population: int, draw: Draw | None = None) -> StrategyState:
        key_mean, key_noise = jax.random.split(key)
        mean = (draw or self._draw)(key_mean, 1)[0]
        return StrategyState(
            mean=mean,
            optimiser=self._optimiser.init(mean),
            noise=jax.random.normal(key_noise, (population // 2, mean.shape[0])),
            evaluations=jnp.zeros(()),
            progress=Progress.create(mean, self.config.restart),
        )

    def genomes(self, state: StrategyState) -> Float[Array, "population genes"]:
        """One of each pair, then all their mirror images."""
        step = self.config.deviation * state.noise
        return jnp.concatenate([state.mean[None] + step, state.mean[None] - step])

    def next_generation(
        self,
        key: Key[Array, ""],
        state: StrategyState,
        fitness: Float[Array, " population"],
        evaluations: Float[Array, " population"] | float = 1.0,
    ) -> StrategyState:
        """Steps up the estimated gradient of the expected rank, or begins anew.

        The gradient is Σ over individuals of rank · noise / (population · σ), the mirrored ones with their
        noise negated.
        """
        del evaluations
        key_noise, key_anew = jax.random.split(key)
        first, mirrored = jnp.split(centred_ranks(fitness), 2)
        # A difference of equals must not be what a fused multiplication rounds: Adam would follow it.
        difference = jnp.where(first == mirrored, 0.0, first - mirrored)
        gradient = difference @ state.noise / (fitness.shape[0] * self.config.deviation)
        step, optimiser = self._optimiser.update(-gradient, state.optimiser)
        state = self._observe(state, fitness)
        stepped = dataclasses.replace(
            state,
            mean=optax.apply_updates(state.mean, step),
            optimiser=optimiser,
            noise=jax.random.normal(key_noise, state.noise.shape),
        )
        stalled = stepped.progress.stalled(self.config.restart, LOW_AVERAGE)
        anew = self._begin_anew(key_anew, stepped)
        return jax.tree.map(lambda new, old: jnp.where(stalled, new, old), anew, stepped)

    def _observe(self, state: StrategyState, fitness: Float[Array, " population"]) -> StrategyState:
        """Takes in one generation's mean fitness."""
        known = jnp.minimum(state.evaluations, self.config.fitness_memory - 1)
        # What nothing is known of may be minus infinity, and that times 0 is no number.
        before = jnp.where(known > 0, state.progress.fitness, 0.0)
        average = (before * known + fitness.mean()) / (known + 1)
        return dataclasses.replace(
            state,
            evaluations=known + 1,
            progress=state.progress.observe(average, fitness, self.config.restart),
        )

    def _begin_anew(self, key: Key[Array, ""], state: StrategyState) -> StrategyState:
        """A new random mean; the given up one is kept if it is the best so far."""
        mean = self._draw(key, 1)[0]
        return StrategyState(
            mean=mean,
            optimiser=self._optimiser.init(mean),
            noise=state.noise,
            evaluations=jnp.zeros(()),
            progress=state.progress.begin_anew(state.mean, self.config.restart),
        )

    def standing(
        self, state: StrategyState, fitness: Float[Array, " population"]
    ) -> Float[Array, " population"]:
        """The fitness itself: nobody lives twice."""
        return fitness

    def champion(self, state: StrategyState) -> Float[Array, " genes"]:
        """The mean, or one that was given up and is not surpassed yet."""
        return state.progress.champion(state.mean)

    def champion_fitness(self, state: StrategyState) -> Float[Array, ""]:
        """The mean fitness of the populations around it, which the noise makes worse than its own."""
        return jnp.maximum(state.progress.kept_fitness, state.progress.fitness)


def centred_ranks(fitness: Float[Array, " population"]) -> Float[Array, " population"]:
    """Ranks from -1/2 for the worst to 1/2 for the best; equals share the mean of theirs.

    Returns of a sparse reward are mostly equal, and an order among equals would be noise.
    """
    below = (fitness[:, None] > fitness[None, :]).sum(1)
    equal_or_below = (fitness[:, None] >= fitness[None, :]).sum(1)
    rank = (below + equal_or_below - 1).astype(jnp.float32) / 2
    return rank / (fitness.shape[0] - 1) - 0.5
