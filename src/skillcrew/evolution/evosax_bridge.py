"""Evolution strategies of evosax as evolvers: CMA-ES, Sep-CMA-ES, OpenAI's ES and SNES.

Each keeps a normal distribution of genomes, samples a population from it, and moves and reshapes it
towards the samples that did well. evosax is an optional dependency, imported when such an evolver is made.
"""

import contextlib
import dataclasses
from collections.abc import Callable, Generator
from types import ModuleType
from typing import Any, Literal, get_args

import equinox as eqx
import jax
import jax.numpy as jnp
import optax
from jaxtyping import Array, Float, Key

from skillcrew.errors import UserError
from skillcrew.evolution.evolver import Draw

EvosaxName = Literal["cma_es", "sep_cma_es", "open_es", "snes"]

EVOSAX_NAMES: tuple[str, ...] = get_args(EvosaxName)

FULL_COVARIANCE_GENES = 1000
"""Genes up to which CMA-ES is offered. Its state holds two matrices of genes², and each generation
decomposes one: on one CPU core in 0.02 s for 500 genes, 0.11 s for 1000, 0.8 s for 2000, for every seed."""

SMALLEST_SHARE = 1e-4
"""Share of `EvosaxConfig.deviation` below which σ never falls. Where the optimum is found it would otherwise
shrink by half every few generations until samples equal the mean, and the distance between them is NaN."""


@dataclasses.dataclass(frozen=True)
class EvosaxConfig:
    """Where the distribution of genomes begins, and how fast it moves where that is not derived."""

    deviation: float = 0.1
    """Standard deviation σ around the mean that each gene begins with, in the gene's own unit; open_es keeps
    it, the others adapt it. As our own strategy's, whose networks are of the same sizes."""
    learning_rate: float = 0.03
    """Adam's step size for the mean of open_es, in the gene's own unit per generation; as our own strategy's.
    The others' steps follow from the numbers of genes and teams (Hansen 2016; Wierstra et al. 2014)."""
    fitness_memory: float = 10.0
    """Generations that the running average of the population's fitness remembers; as our own strategy's."""

    def __post_init__(self) -> None:
        for field in ("deviation", "learning_rate"):
            if not 0 < getattr(self, field) < float("inf"):
                raise UserError(f"evosax.{field} = {getattr(self, field)}: give a positive number")
        if not self.fitness_memory >= 1:
            raise UserError(f"evosax.fitness_memory = {self.fitness_memory}: give at least 1 generation")

    def check_population(self, population: int, evolver: str) -> None:
        """Raises `UserError` if the evolver cannot learn from a population of this size."""
        if evolver == "open_es" and (population < 2 or population % 2):
            raise UserError(
                f"population = {population}: evolver = open_es samples mirrored pairs; give an even number "
                "of at least 2"
            )
        if evolver != "open_es" and population < 4:
            raise UserError(
                f"population = {population}: evolver = {evolver} weighs the better half against the worse; "
                "give at least 4"
            )


class EvosaxState(eqx.Module):
    """The distribution, and the population sampled from it that is to be evaluated next."""

    distribution: Any
    """evosax' state, in arrays. The best so far in it is the luckiest of noisy evaluations; nothing reads
    it."""
    population: Float[Array, "population genes"]
    fitness: Float[Array, ""]
    """Running average of the population's mean fitness."""
    evaluations: Float[Array, ""]
    """Generations that it stands for."""


class EvosaxStrategy:
    """An `Evolver` whose champion is the distribution's mean, which no noise of its own evaluation selects.

    evosax minimises and our fitness is better if larger: `next_generation` tells it minus the fitness, which
    is the one place where the sign changes. Only the order of fitness counts: see `_shaping`.
    No individual survives a generation, and the mean is not evaluated itself.

    Args:
        name: which strategy.
        config: see there.
        draw: draws so many random genomes; the first mean is one of them.
        population: of which `init` is to make the state.

    Raises:
        UserError: evosax is not installed, or there are too many genes for a full covariance matrix.
    """

    def __init__(self, name: EvosaxName, config: EvosaxConfig, draw: Draw, population: int):
        self.config = config
        self._draw = draw
        genes = jax.eval_shape(lambda key: draw(key, 1), jax.random.key(0)).shape[1]
        if name == "cma_es" and genes > FULL_COVARIANCE_GENES:
            raise UserError(
                f"evolver = cma_es: {genes} genes make a covariance matrix of {genes}² numbers, "
                f"{4 * genes**2 / 2**20:.0f} MiB, to decompose in every generation; set evolver to "
                f"sep_cma_es, or make the networks smaller, to at most {FULL_COVARIANCE_GENES} genes"
            )
        algorithms = _evosax(name)
        # Constants even if this runs while a program is traced, which they outlive.
        with jax.ensure_compile_time_eval(), _usual_promotion():
            self._algorithm = _make(algorithms, name, config, population, genes)
            self._params = _parameters(name, self._algorithm, config)

    def init(self, key: Key[Array, ""], population: int, draw: Draw | None = None) -> EvosaxState:
        assert population == self._algorithm.population_size
        key_mean, key_begin, key_sample = jax.random.split(key, 3)
        mean = (draw or self._draw)(key_mean, 1)[0]
        with _usual_promotion():
            distribution = self._algorithm.init(key_begin, mean, self._params)
        # evosax begins with NaN here, which never compares as equal to itself.
        distribution = distribution.replace(best_solution=jnp.zeros_like(mean))
        return self._sample(key_sample, distribution, jnp.zeros(()), jnp.zeros(()))

    def genomes(self, state: EvosaxState) -> Float[Array, "population genes"]:
        """The samples."""
        return state.population

    def next_generation(
        self,
        key: Key[Array, ""],
        state: EvosaxState,
        fitness: Float[Array, " population"],
        evaluations: Float[Array, " population"] | float = 1.0,
    ) -> EvosaxState:
        """Moves the distribution towards the fitter samples, and samples anew."""
        del evaluations
        key_tell, key_sample = jax.random.split(key)
        with _usual_promotion():
            distribution, _ = self._algorithm.tell(
                key_tell, state.population, -fitness, state.distribution, self._params
            )
        smallest = SMALLEST_SHARE * self.config.deviation
        distribution = distribution.replace(std=jnp.maximum(distribution.std, smallest))
        known = jnp.minimum(state.evaluations, self.config.fitness_memory - 1)
        average = (state.fitness * known + fitness.mean()) / (known + 1)
        return self._sample(key_sample, distribution, average, known + 1)

    def _sample(
        self, key: Key[Array, ""], distribution: Any, fitness: Float[Array, ""], evaluations: Float[Array, ""]
    ) -> EvosaxState:
        with _usual_promotion():
            population, distribution = self._algorithm.ask(key, distribution, self._params)
        # Some of evosax' state is of a weak type before the first generation and of a plain one after it.
        distribution = jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.result_type(leaf)), distribution)
        return EvosaxState(distribution, population, fitness, evaluations)

    def standing(
        self, state: EvosaxState, fitness: Float[Array, " population"]
    ) -> Float[Array, " population"]:
        """The fitness itself: nobody lives twice."""
        return fitness

    def champion(self, state: EvosaxState) -> Float[Array, " genes"]:
        """The mean of the distribution."""
        return state.distribution.mean

    def champion_fitness(self, state: EvosaxState) -> Float[Array, ""]:
        """The mean fitness of the populations around it, which their spread makes worse than its own."""
        return state.fitness


def shared_weights(
    loss: Float[Array, " population"], weights: Float[Array, " population"]
) -> Float[Array, " population"]:
    """Each individual's weight by its rank; equals share the mean of theirs.

    Args:
        loss: smaller is better.
        weights: of the ranks, the best one's first.
    """
    below = (loss[:, None] > loss[None, :]).sum(1)
    up_to = (loss[:, None] >= loss[None, :]).sum(1)
    total = jnp.concatenate([jnp.zeros(1, weights.dtype), jnp.cumsum(weights)])
    return (total[up_to] - total[below]) / (up_to - below).astype(weights.dtype)


def ordered_weights(
    loss: Float[Array, " population"], weights: Float[Array, " population"]
) -> Float[Array, " population"]:
    """Each individual's weight by its rank; equals are ranked in the order in which they were sampled.

    Args:
        loss: smaller is better.
        weights: of the ranks, the best one's first.
    """
    return jnp.zeros_like(weights).at[jnp.argsort(loss, stable=True)].set(weights)


def _shaping(weigh: Callable[..., Array]) -> Callable[..., Array]:
    """What evosax asks to turn a loss into weights.

    Its own gives all equals the weight of their middle rank, so that weights no longer add up as they
    should. Returns of a sparse reward are mostly equal; where all were, 200 generations of 40 took CMA-ES's σ
    from 0.1 to 2e-10 (100 genes) and Sep-CMA-ES's to 6e-4 (484 genes), and SNES's mean followed the noise.
    """
    return lambda population, loss, state, params: weigh(loss, params.weights)


def _make(algorithms: ModuleType, name: EvosaxName, config: EvosaxConfig, population: int, genes: int) -> Any:
    genome = jnp.zeros(genes)
    match name:
        # The step size is judged by how far random weights would take the mean, so that equals need distinct
        # ones too; whichever get them, for samples are independent.
        case "cma_es":
            return algorithms.CMA_ES(population, genome, fitness_shaping_fn=_shaping(ordered_weights))
        case "sep_cma_es":
            return algorithms.Sep_CMA_ES(population, genome, fitness_shaping_fn=_shaping(ordered_weights))
        case "snes":
            return algorithms.SNES(population, genome, fitness_shaping_fn=_shaping(shared_weights))
        case "open_es":
            # Its centred ranks are shared by equals already.
            return algorithms.Open_ES(
                population,
                genome,
                optimizer=optax.adam(config.learning_rate),
                std_schedule=optax.constant_schedule(config.deviation),
            )


def _parameters(name: EvosaxName, algorithm: Any, config: EvosaxConfig) -> Any:
    params = algorithm.default_params
    if name == "open_es":
        return params
    params = params.replace(std_init=config.deviation)
    if name == "sep_cma_es":
        # evosax leaves the full matrix's rates, by which variances of hundreds of genes would never change;
        # Ros and Hansen (2008) learn the diagonal faster by this factor.
        faster = (algorithm.num_dims + 2) / 3
        c_1 = faster * params.c_1
        params = params.replace(c_1=c_1, c_mu=jnp.minimum(faster * params.c_mu, 1 - c_1))
    return params


def _evosax(name: str) -> ModuleType:
    try:
        from evosax import algorithms
    except ModuleNotFoundError as error:
        raise UserError(
            f"evolver = {name}: needs evosax, which is not installed; pip install 'skillcrew[evolution]'"
        ) from error
    return algorithms


@contextlib.contextmanager
def _usual_promotion() -> Generator[None]:
    """Evosax mixes numbers and ranks, whatever the program that it is part of forbids."""
    with jax.numpy_dtype_promotion("standard"), jax.numpy_rank_promotion("allow"):
        yield
