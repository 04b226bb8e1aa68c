"""The evolutionary half of every algorithm: a population of teams lives, is ranked, and evolves."""

import dataclasses
from collections.abc import Callable
from typing import Any, Literal, cast, get_args

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, Key, PyTree

from skillcrew.envs.environment import Environment
from skillcrew.errors import UserError, unknown_name
from skillcrew.evolution.coevolution import CoevolutionConfig, CooperativeCoevolution
from skillcrew.evolution.evolver import Evolver, Host, Migrants
from skillcrew.evolution.evosax_bridge import EVOSAX_NAMES, EvosaxConfig, EvosaxName, EvosaxStrategy
from skillcrew.evolution.genetic import EvolutionConfig, GeneticAlgorithm
from skillcrew.evolution.selection import rank
from skillcrew.evolution.strategy import EvolutionStrategy, StrategyConfig
from skillcrew.evolution.variation import Variation, WeightVariation, around
from skillcrew.policies.population import GenomeCodec
from skillcrew.policies.team import Team
from skillcrew.rollout import Episodes, Lineup, Start, rollout

EvolverName = Literal["genetic", "strategy", "coevolution", EvosaxName]
HOSTS: tuple[EvolverName, ...] = ("genetic", "coevolution")
"""Evolvers with places that migrants can take; see `Host`."""


@dataclasses.dataclass(frozen=True)
class RaceConfig:
    """The best few live more episodes before they are ranked, which count as environment steps."""

    finalists: int = 0
    """Teams that live them; 0 for no race."""
    episodes: int = 20
    """More episodes of each finalist, the same for all of them, with the noise that all others had."""

    def __post_init__(self) -> None:
        if self.finalists < 0:
            raise UserError(f"race.finalists = {self.finalists}: give a number of teams, or 0 for no race")
        if self.episodes < 1:
            raise UserError(f"race.episodes = {self.episodes}: give at least 1")


@dataclasses.dataclass(frozen=True)
class SearchConfig:
    """How teams are evaluated, and how they evolve."""

    population: int = 40
    """Teams (M)."""
    episodes: int = 5
    """Evaluation episodes per team and generation (num_envs); see `episodes_shared_by`. Few, for lineage
    averages make up for the noise."""
    fitness_discount: float = 0.98
    """Discount per step of the team reward in a team's fitness; below 1 the quicker of two teams ranks
    higher. Champions are scored without it."""
    episodes_shared_by: Literal["population", "pair"] = "population"
    """Who meets the same episodes: "population" for all teams, "pair" for each mirrored pair of an
    evolution strategy its own, so that a generation sees many more worlds."""
    evolver: EvolverName = "genetic"
    """"genetic" (Algorithm 1) breeds the best teams, "strategy" moves the mean of a cloud, "coevolution"
    has a subpopulation for each agent; the others are evosax's (docs/algorithms/evolvers.md)."""
    evolution: EvolutionConfig = dataclasses.field(default_factory=EvolutionConfig)
    """How the genetic algorithm breeds, and each subpopulation of a coevolution."""
    coevolution: CoevolutionConfig = dataclasses.field(default_factory=CoevolutionConfig)
    """How teams are drawn across subpopulations."""
    strategy: StrategyConfig = dataclasses.field(default_factory=StrategyConfig)
    """How the evolution strategy moves."""
    evosax: EvosaxConfig = dataclasses.field(default_factory=EvosaxConfig)
    """How evosax' evolution strategies move."""
    race: RaceConfig = dataclasses.field(default_factory=RaceConfig)
    """Whether the best few are scored again before they are ranked."""

    def __post_init__(self) -> None:
        for field in ("population", "episodes"):
            if getattr(self, field) < 1:
                raise UserError(f"{field} = {getattr(self, field)}: give at least 1")
        if not 0 < self.fitness_discount <= 1:
            raise UserError(
                f"fitness_discount = {self.fitness_discount}: give a number above 0 and up to 1 (no discount)"
            )
        self._check_evolver()
        if self.episodes_shared_by not in ("population", "pair"):
            raise unknown_name("episodes_shared_by", str(self.episodes_shared_by), ("population", "pair"))
        if self.episodes_shared_by == "pair" and self.evolver != "strategy":
            raise UserError(
                f"episodes_shared_by = pair: evolver = {self.evolver} has no pairs that share them, only "
                "strategy has; set episodes_shared_by to population"
            )
        if self.race.finalists and self.evolver in ("strategy", *EVOSAX_NAMES):
            raise UserError(
                f"race.finalists = {self.race.finalists}: an evolution strategy weighs every team alike, so "
                "a race has nothing to decide; set race.finalists to 0 or evolver to genetic"
            )
        if self.race.finalists > self.population:
            raise UserError(
                f"race.finalists = {self.race.finalists}: above population = {self.population}; lower it"
            )

    def unused(self, env: Environment) -> set[str]:
        """Names of the sections that the evolver does not look at."""
        del env
        used = {
            "genetic": {"evolution"},
            "strategy": {"strategy"},
            "coevolution": {"evolution", "coevolution"},
        }
        return {"evolution", "coevolution", "strategy", "evosax"} - used.get(self.evolver, {"evosax"})

    def _check_evolver(self) -> None:
        match self.evolver:
            case "genetic":
                self.evolution.check_population(self.population)
            case "strategy":
                self.strategy.check_population(self.population)
            case "coevolution":
                self.coevolution.check_population(self.population, self.evolution)
            case "cma_es" | "sep_cma_es" | "open_es" | "snes":
                self.evosax.check_population(self.population, self.evolver)
            case _:
                raise unknown_name("evolver", str(self.evolver), get_args(EvolverName))


class TeamSearch:
    """A population of teams that lives the same fresh episodes each generation, and evolves.

    Args:
        env: where they live.
        codec: draws a team's networks, and turns genomes into them.
        config: see there.
        vary: how the genomes of so many networks are varied; by default as weights are.

    Raises:
        UserError: the evolver does not suit the number of agents or networks.
    """

    def __init__(
        self,
        env: Environment,
        codec: GenomeCodec,
        config: SearchConfig,
        vary: Callable[[int], Variation] | None = None,
    ):
        self.config = config
        self._env = env
        self._codec = codec
        vary = vary or (lambda _: WeightVariation(config.evolution.mutation))
        self._variation = vary(codec.networks)
        self._evolver = _make_evolver(config, codec, env.n_agents, vary)

    @property
    def worlds(self) -> int:
        """Worlds that the population lives in."""
        return self.config.population * self.config.episodes

    def init(self, key: Key[Array, ""], founder: PyTree | None = None) -> Any:
        """The evolver's state, with a random population, or with one around a founder.

        Args:
            founder: a team's networks. A population is these and mutants of them, a strategy's mean these.
        """
        draw = None if founder is None else around(self.encode(founder), self._variation)
        return self._evolver.init(key, self.config.population, draw)

    def start(self, key: Key[Array, ""]) -> Start:
        """Fresh worlds: as many as a team lives in, or as all pairs of teams do."""
        pairs = self.config.population // 2 if self.config.episodes_shared_by == "pair" else 1
        return Start.draw(self._env, key, pairs * self.config.episodes)

    def lineup(self, state: Any, start: Start, make_team: Callable[[PyTree], Team]) -> Lineup:
        """Every team of the population in its worlds, team by team."""
        genomes = self._evolver.genomes(state)
        lineup = self._lineup(genomes, start.first(self.config.episodes), make_team)
        if self.config.episodes_shared_by == "population":
            return lineup
        # One of each pair, then their mirror images: both halves meet the pairs' worlds in order.
        return dataclasses.replace(lineup, start=start.repeat(2))

    def champion(self, state: Any) -> PyTree:
        """The networks of the team to report."""
        return self._codec.decode(self._evolver.champion(state))

    def encode(self, networks: PyTree) -> Float[Array, " genes"]:
        """The genome of a team's networks."""
        return self._codec.encode(networks)

    def fitness(self, episodes: Episodes, teams: int) -> Float[Array, " teams"]:
        """Each team's mean discounted return; the worlds are ordered team by team."""
        returns = episodes.team_return(self.config.fitness_discount)
        return returns.reshape(teams, -1).mean(1)

    def evolve(
        self,
        key: Key[Array, ""],
        state: Any,
        episodes: Episodes,
        make_team: Callable[[PyTree], Team],
        migrants: Migrants | None = None,
        credit: Float[Array, "worlds agents"] | None = None,
        noise: Float[Array, ""] | float = 0.0,
    ) -> tuple[Any, dict[str, Array]]:
        """Ranks the teams by the episodes of their lineup, after a race if there is one, and breeds.

        Args:
            noise: on the actions of these episodes, and so of the race's: fitness is of one kind.
            migrants: take the places of the worst before these breed; for an evolver that is a `Host`.
            credit: each agent's own part of its team's return, which it is bred for; of coevolution alone.

        Returns:
            The new state, and metrics, among them `race_steps`: environment steps of the race.
        """
        fitness = self.fitness(episodes, self.config.population)
        metrics = {"fitness_best": fitness.max(), "fitness_mean": fitness.mean()}
        evaluations = jnp.ones(self.config.population)
        if self.config.race.finalists:
            key, key_race = jax.random.split(key)
            fitness, evaluations, metrics["race_steps"] = self._race(
                key_race, state, fitness, make_team, noise
            )
        if credit is not None:
            coevolution = cast(CooperativeCoevolution, self._evolver)
            of_teams = credit.reshape(self.config.population, -1, credit.shape[1]).mean(1)
            state = coevolution.next_generation(key, state, fitness, evaluations, credit=of_teams)
        elif migrants is None:
            state = self._evolver.next_generation(key, state, fitness, evaluations)
        else:
            host = cast(Host, self._evolver)
            state = host.next_generation(key, state, fitness, evaluations, migrants)
        return state, {**metrics, "champion_fitness": self._evolver.champion_fitness(state)}

    def _lineup(
        self, genomes: Float[Array, "teams genes"], start: Start, make_team: Callable[[PyTree], Team]
    ) -> Lineup:
        networks = jax.vmap(self._codec.decode)(genomes)
        return Lineup.of_teams(make_team, networks, genomes.shape[0], start)

    def _race(
        self,
        key: Key[Array, ""],
        state: Any,
        fitness: Float[Array, " population"],
        make_team: Callable[[PyTree], Team],
        noise: Float[Array, ""] | float,
    ) -> tuple[Float[Array, " population"], Float[Array, " population"], Int[Array, ""]]:
        """Fitness with the finalists' further episodes, the evaluations it rests on, and the race's steps."""
        race = self.config.race
        key_start, key_rollout = jax.random.split(key)
        finalists = rank(self._evolver.standing(state, fitness))[: race.finalists]
        start = Start.draw(self._env, key_start, race.episodes)
        lineup = self._lineup(self._evolver.genomes(state)[finalists], start, make_team)
        episodes, _ = rollout(self._env, lineup, key_rollout, noise)
        more = episodes.team_return(self.config.fitness_discount).reshape(race.finalists, -1).mean(1)
        share = self.config.episodes / (self.config.episodes + race.episodes)
        fitness = fitness.at[finalists].set(share * fitness[finalists] + (1 - share) * more)
        evaluations = jnp.ones_like(fitness).at[finalists].set(1 / share)
        return fitness, evaluations, episodes.steps()


def _make_evolver(
    config: SearchConfig, codec: GenomeCodec, n_agents: int, vary: Callable[[int], Variation]
) -> Evolver:
    if config.evolver == "genetic":
        return GeneticAlgorithm(config.evolution, codec.create, vary(codec.networks))
    if config.evolver == "strategy":
        return EvolutionStrategy(config.strategy, codec.create)
    if config.evolver != "coevolution":
        return EvosaxStrategy(config.evolver, config.evosax, codec.create, config.population)
    if codec.networks != n_agents:
        raise UserError(
            "evolver = coevolution: each agent's own network has a subpopulation; set its sharing to agent"
        )
    config.coevolution.check_agents(config.population, n_agents)
    return CooperativeCoevolution(config.evolution, config.coevolution, codec.create, n_agents, vary(1))
