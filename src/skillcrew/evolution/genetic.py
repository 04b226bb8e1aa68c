"""The genetic algorithm of Algorithm 1: ranking, elites, tournament, crossover, mutation."""

import dataclasses
from typing import Literal

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, Key

from skillcrew.errors import UserError, unknown_name
from skillcrew.evolution.evolver import Draw, Migrants
from skillcrew.evolution.lineage import Level, Lineage
from skillcrew.evolution.mutation import MutationConfig
from skillcrew.evolution.phases import PhaseMutationConfig
from skillcrew.evolution.restart import Progress, RestartConfig
from skillcrew.evolution.selection import proportional, rank, tournament
from skillcrew.evolution.variation import Variation, WeightVariation


@dataclasses.dataclass(frozen=True)
class EvolutionConfig:
    """How the next generation is made of the last."""

    elites: int = 4
    """Fittest individuals that survive unchanged (e). A tenth of the population did best."""
    selection: Literal["tournament", "proportional"] = "tournament"
    """How the selected set S is drawn: by tournaments (Algorithm 1), or with probability proportional to
    fitness (thesis, section 3.2.2), counted from the worst where that is below 0."""
    tournament_size: int = 3
    """Entrants of a tournament, drawn with replacement (ERL)."""
    crossover_share: float = 0.5
    """Share of the children made by crossover between an elite and a member of S; the others
    are members of S themselves. Both then mutate."""
    lineage_memory: float = 40.0
    """Evaluations that an individual's mean fitness remembers; 1 ranks by the last one alone."""
    lineage_prior: float = 3.0
    """Evaluations at the population's mean fitness that each individual is ranked as if it had lived
    too, so that a newcomer's one lucky evaluation does not outrank an elite's ten good ones."""
    champion_prior: float = 20.0
    """The same when the champion is chosen among the elites: it is to be the surest, not the most
    promising."""
    lineage_inheritance: float = 0.0
    """Share of its parent's evaluations that a changed child starts with; above 0 children outrank their
    parents later."""
    mutation: MutationConfig = dataclasses.field(default_factory=MutationConfig)
    """How the weights of children change."""
    phases: PhaseMutationConfig = dataclasses.field(default_factory=PhaseMutationConfig)
    """How the timetables of children change, where selectors have phases."""
    veterans: int = 0
    """Elites that are such because they are the surest, by `champion_prior`: newcomers who have been lucky so
    far do not crowd them out."""
    level_memory: float = 1.0
    """Generations that the population's mean fitness, of the two priors, is averaged over. All teams of a
    generation may live the same few episodes: where these are easy, everybody's newcomers look perfect."""
    challengers: int = 0
    """Others that survive unchanged, because their own mean fitness is the highest, however few evaluations
    it rests on: what one lucky evaluation promises is looked at again, but does not lead."""
    restart: RestartConfig = dataclasses.field(default_factory=RestartConfig)
    """When the search begins anew. Its fitness is the champion's, drawn to the population's mean by
    `champion_prior`."""

    def __post_init__(self) -> None:
        if self.selection not in ("tournament", "proportional"):
            raise unknown_name("evolution.selection", str(self.selection), ("tournament", "proportional"))
        if self.elites < 1:
            raise UserError(f"evolution.elites = {self.elites}: give at least 1, or the champion is lost")
        if not 0 <= self.veterans <= self.elites:
            raise UserError(
                f"evolution.veterans = {self.veterans}: give 0 to evolution.elites = {self.elites} of these"
            )
        if self.challengers < 0:
            raise UserError(f"evolution.challengers = {self.challengers}: give individuals, or 0 for none")
        if self.tournament_size < 1:
            raise UserError(f"evolution.tournament_size = {self.tournament_size}: give at least 1")
        for field in ("crossover_share", "lineage_inheritance"):
            if not 0 <= getattr(self, field) <= 1:
                raise UserError(f"evolution.{field} = {getattr(self, field)}: give a share between 0 and 1")
        for field in ("lineage_prior", "champion_prior"):
            if not getattr(self, field) >= 0:
                raise UserError(f"evolution.{field} = {getattr(self, field)}: give a number of at least 0")
        if not self.lineage_memory >= 1:
            raise UserError(f"evolution.lineage_memory = {self.lineage_memory}: give at least 1 evaluation")
        if not self.level_memory >= 1:
            raise UserError(f"evolution.level_memory = {self.level_memory}: give at least 1 generation")

    def check_population(self, population: int) -> None:
        """Raises `UserError` if a population of this size leaves no room for children."""
        if population < self.smallest_population:
            raise UserError(
                f"population = {population}: smaller than {self.survivors} + 2 = "
                f"{self.smallest_population}; raise population or lower {self.survivors.replace('+', 'or')}"
            )

    @property
    def smallest_population(self) -> int:
        """Individuals that survive, and two children."""
        return self.elites + self.challengers + 2

    @property
    def survivors(self) -> str:
        """The fields that say how many individuals survive, as a sum."""
        return "evolution.elites + evolution.challengers" if self.challengers else "evolution.elites"


class GeneticState(eqx.Module):
    """A population and what is known of it. Elites come first, the surest of them, the champion, at 0."""

    genomes: Float[Array, "population genes"]
    lineage: Lineage
    level: Level
    progress: Progress

    @classmethod
    def create(
        cls, genomes: Float[Array, "population genes"], restart: RestartConfig | None = None
    ) -> "GeneticState":
        """Of a search that begins.

        Args:
            restart: when it will begin anew; by default never.
        """
        progress = Progress.create(genomes[0], restart or RestartConfig())
        return cls(genomes, Lineage.create(genomes.shape[0]), Level.create(), progress)


class GeneticAlgorithm:
    """The `Evolver` of Algorithm 1.

    Args:
        config: see there.
        draw: draws so many random genomes.
        variation: how children are made; by default as weights are varied.
    """

    def __init__(self, config: EvolutionConfig, draw: Draw, variation: Variation | None = None):
        self.config = config
        self._draw = draw
        self._variation = variation or WeightVariation(config.mutation)

    def init(self, key: Key[Array, ""], population: int, draw: Draw | None = None) -> GeneticState:
        return GeneticState.create((draw or self._draw)(key, population), self.config.restart)

    def genomes(self, state: GeneticState) -> Float[Array, "population genes"]:
        return state.genomes

    def next_generation(
        self,
        key: Key[Array, ""],
        state: GeneticState,
        fitness: Float[Array, " population"],
        evaluations: Float[Array, " population"] | float = 1.0,
        migrants: Migrants | None = None,
    ) -> GeneticState:
        if migrants is not None:
            state, fitness, evaluations = self._admit(state, fitness, evaluations, migrants)
        if not self.config.restart.patience:
            return next_generation(key, state, fitness, self.config, evaluations, self._variation)
        key, key_anew = jax.random.split(key)
        state = next_generation(key, state, fitness, self.config, evaluations, self._variation)
        anew = self._begin_anew(key_anew, state)
        stalled = state.progress.stalled(self.config.restart)
        return jax.tree.map(lambda new, old: jnp.where(stalled, new, old), anew, state)

    def _begin_anew(self, key: Key[Array, ""], state: GeneticState) -> GeneticState:
        restart = self.config.restart
        anew = GeneticState.create(self._draw(key, state.genomes.shape[0]), restart)
        return dataclasses.replace(anew, progress=state.progress.begin_anew(state.genomes[0], restart))

    def _admit(
        self,
        state: GeneticState,
        fitness: Float[Array, " population"],
        evaluations: Float[Array, " population"] | float,
        migrants: Migrants,
    ) -> tuple[GeneticState, Float[Array, " population"], Float[Array, " population"]]:
        """Migrants in the place of the worst, with nothing known of them but this evaluation."""
        count = migrants.fitness.shape[0]
        lineage = state.lineage.add(fitness, self.config.lineage_memory, evaluations)
        level = state.level.add(lineage, self.config.level_memory)
        worst = rank(lineage.standing(self.config.lineage_prior, level.mean))[-count:]

        def replaced(old: Array, new: Array | float) -> Array:
            return jnp.where(migrants.arrive, old.at[worst].set(new), old)

        lineage = Lineage(state.lineage.mean, replaced(state.lineage.evaluations, 0.0))
        genomes = replaced(state.genomes, migrants.genomes)
        admitted = dataclasses.replace(state, genomes=genomes, lineage=lineage)
        evaluations = replaced(jnp.broadcast_to(evaluations, fitness.shape), 1.0)
        return admitted, replaced(fitness, migrants.fitness), evaluations

    def standing(
        self, state: GeneticState, fitness: Float[Array, " population"]
    ) -> Float[Array, " population"]:
        lineage = state.lineage.add(fitness, self.config.lineage_memory)
        level = state.level.add(lineage, self.config.level_memory)
        return lineage.standing(self.config.lineage_prior, level.mean)

    def champion(self, state: GeneticState) -> Float[Array, " genes"]:
        """The surest elite of the last evaluation; see `EvolutionConfig.champion_prior`."""
        return state.progress.champion(state.genomes[0])

    def champion_fitness(self, state: GeneticState) -> Float[Array, ""]:
        """The mean over its lineage; what was known of it, if its search was given up."""
        progress = state.progress
        return jnp.where(progress.outdone, progress.kept_fitness, state.lineage.mean[0])


def next_generation(
    key: Key[Array, ""],
    state: GeneticState,
    fitness: Float[Array, " population"],
    config: EvolutionConfig,
    evaluations: Float[Array, " population"] | float = 1.0,
    variation: Variation | None = None,
) -> GeneticState:
    """Lines 10 to 15 of Algorithm 1, and mutation.

    The scan of lines 12 to 15 fills S twice over; read here as: S holds the winners of k - e
    draws, and `crossover_share` of the children are crossed with a random elite.

    Args:
        fitness: of the present population, in its order.
        evaluations: how much of an evaluation each fitness rests on.
        variation: how children are made; by default as weights are varied.
    """
    variation = variation or WeightVariation(config.mutation)
    lineage = state.lineage.add(fitness, config.lineage_memory, evaluations)
    level = state.level.add(lineage, config.level_memory)
    standing = lineage.standing(config.lineage_prior, level.mean)
    sure = lineage.standing(config.champion_prior, level.mean)
    elites = elected(standing, sure, config)
    promise = lineage.mean.at[elites].set(-jnp.inf)
    survivors = jnp.concatenate([elites, rank(promise)[: config.challengers]])
    genomes, inherited = breed(key, state.genomes, fitness, lineage, standing, elites, config, variation)
    return GeneticState(
        jnp.concatenate([state.genomes[survivors], genomes]),
        lineage.pick(survivors).concatenate(inherited),
        level,
        state.progress.observe(sure[elites[0]], fitness, config.restart),
    )


def breed(
    key: Key[Array, ""],
    genomes: Float[Array, "population genes"],
    fitness: Float[Array, " population"],
    lineage: Lineage,
    standing: Float[Array, " population"],
    elites: Int[Array, " elites"],
    config: EvolutionConfig,
    variation: Variation,
) -> tuple[Float[Array, "children genes"], Lineage]:
    """Children of those that are selected, some crossed with a random elite, and what is known of them."""
    key_select, key_pair, key_cross, key_mutate = jax.random.split(key, 4)
    children = genomes.shape[0] - config.elites - config.challengers
    crossed = round(config.crossover_share * children)
    if config.selection == "tournament":
        selected = tournament(key_select, standing, children, config.tournament_size)
    else:
        selected = proportional(key_select, standing, children)

    bounds = jnp.array([children, config.elites], jnp.int32)
    pairs = jax.random.randint(key_pair, (crossed, 2), 0, bounds[None], jnp.int32)
    partners, mates = selected[pairs[:, 0]], elites[pairs[:, 1]]
    offspring = variation.crossover(key_cross, genomes[mates], genomes[partners])
    copies = selected[crossed:]
    bred = jnp.concatenate([offspring, genomes[copies]])
    bred, mutated = variation.mutate(key_mutate, bred, jnp.ptp(fitness) > 0)
    # A crossed child is new; a copy that mutation spared is its parent and keeps all it has earned.
    is_new = mutated | (jnp.arange(children) < crossed)
    parents = jnp.concatenate([partners, copies])
    return bred, lineage.pick(parents, jnp.where(is_new, config.lineage_inheritance, 1.0))


def elected(
    standing: Float[Array, " population"], sure: Float[Array, " population"], config: EvolutionConfig
) -> Int[Array, " elites"]:
    """The elites, the surest first: veterans, who are the surest of all, and the best of the others.

    Args:
        standing: by `lineage_prior`.
        sure: by `champion_prior`.
    """
    veterans = rank(sure)[: config.veterans]
    others = rank(standing.at[veterans].set(-jnp.inf))[: config.elites - config.veterans]
    elites = jnp.concatenate([veterans, others])
    return elites[rank(sure[elites])]
