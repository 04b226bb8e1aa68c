"""Cooperative coevolution: a subpopulation for each agent, and teams drawn across them (thesis, 2.1.9)."""

import dataclasses
from typing import Literal

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, Key

from skillcrew.errors import UserError, unknown_name
from skillcrew.evolution.evolver import Draw, Migrants
from skillcrew.evolution.genetic import EvolutionConfig, GeneticAlgorithm, GeneticState
from skillcrew.evolution.hall_of_fame import HallOfFame, HallOfFameConfig
from skillcrew.evolution.variation import Variation


@dataclasses.dataclass(frozen=True)
class CoevolutionConfig:
    """Who plays with whom, and what an individual is credited with."""

    teams: int = 1
    """Teams in which each individual plays per generation (L); a subpopulation has population / teams
    individuals. More than one is what leniency and the hall of fame need."""
    credit: Literal["max", "mean", "min"] = "max"
    """What an individual's fitness is of its teams' fitness. "max" is leniency (Panait 2010): it is not
    blamed for the poor partners that it was drawn with."""
    hall_of_fame: HallOfFameConfig = dataclasses.field(default_factory=HallOfFameConfig)
    """Whether the best teams of earlier generations are teamed up with too."""

    def __post_init__(self) -> None:
        if self.teams < 1:
            raise UserError(f"coevolution.teams = {self.teams}: give at least 1")
        if self.credit not in ("max", "mean", "min"):
            raise unknown_name("coevolution.credit", str(self.credit), ("max", "mean", "min"))
        if self.hall_of_fame.size and self.teams < 2:
            raise UserError(
                f"coevolution.hall_of_fame.size = {self.hall_of_fame.size}: each individual's first team is "
                "of the living alone; set coevolution.teams to at least 2"
            )

    def check_population(self, population: int, evolution: EvolutionConfig) -> None:
        """Raises `UserError` if so many teams do not make whole subpopulations that can breed."""
        if population % self.teams:
            raise UserError(
                f"population = {population}: no multiple of coevolution.teams = {self.teams}, so that each "
                "individual could play in as many; change one of them"
            )
        if evolution.restart.patience:
            raise UserError(
                f"evolution.restart.patience = {evolution.restart.patience}: evolver = coevolution never "
                "begins anew; set it to 0"
            )
        size = population // self.teams
        if size < evolution.smallest_population:
            raise UserError(
                f"population = {population}: with coevolution.teams = {self.teams} a subpopulation has "
                f"{size} individuals, fewer than {evolution.survivors} + 2 = "
                f"{evolution.smallest_population}; raise population or lower one of the others"
            )

    def check_agents(self, population: int, n_agents: int) -> None:
        """Raises `UserError` if an individual cannot meet other partners in each of its teams."""
        possible = (population // self.teams) ** (n_agents - 1)
        if self.teams > possible:
            raise UserError(
                f"coevolution.teams = {self.teams}: with {n_agents} agent(s) there are only {possible} "
                f"team(s) that an individual can play in; set it to at most {possible}"
            )


class CoevolutionState(eqx.Module):
    """All subpopulations, and the teams that are to be evaluated next."""

    subpopulations: GeneticState
    """Leaves have a leading agent axis."""
    members: Int[Array, "teams agents"]
    """Each place's individual, by its index in the agent's subpopulation; from the subpopulation's size on,
    by that of a team of the hall of fame."""
    hall: HallOfFame | None
    """None without one: an array of nothing cannot be saved."""


class CooperativeCoevolution:
    """The `Evolver` of CCEA: each agent's subpopulation breeds by the genetic algorithm.

    A genome is a team's, agent by agent. Teams are drawn by random permutations of the subpopulations,
    so that everybody plays equally often; then some places may be filled from the hall of fame.

    Args:
        evolution: how each subpopulation breeds.
        config: see there.
        draw: draws so many random genomes of whole teams.
        n_agents: networks of a team, each with an equal share of the genome.
        variation: how the children of one agent's subpopulation are made; by default as weights are varied.
    """

    def __init__(
        self,
        evolution: EvolutionConfig,
        config: CoevolutionConfig,
        draw: Draw,
        n_agents: int,
        variation: Variation | None = None,
    ):
        self.config = config
        self._n_agents = n_agents
        self._draw = draw
        self._breeder = GeneticAlgorithm(evolution, draw, variation)

    def init(self, key: Key[Array, ""], population: int, draw: Draw | None = None) -> CoevolutionState:
        key_draw, key_teams = jax.random.split(key)
        size = population // self.config.teams
        genomes = (draw or self._draw)(key_draw, size).reshape(size, self._n_agents, -1)
        restart = self._breeder.config.restart
        subpopulations = jax.vmap(lambda own: GeneticState.create(own, restart), in_axes=1)(genomes)
        kept = self.config.hall_of_fame.size
        hall = HallOfFame.create(kept, self._n_agents, genomes.shape[-1]) if kept else None
        return CoevolutionState(subpopulations, self._team_up(key_teams, size, hall), hall)

    def genomes(self, state: CoevolutionState) -> Float[Array, "population genes"]:
        """The teams, each with the genomes of its members."""
        return self._teams(state).reshape(state.members.shape[0], -1)

    def next_generation(
        self,
        key: Key[Array, ""],
        state: CoevolutionState,
        fitness: Float[Array, " population"],
        evaluations: Float[Array, " population"] | float = 1.0,
        migrants: Migrants | None = None,
        credit: Float[Array, "population agents"] | None = None,
    ) -> CoevolutionState:
        """Credits the individuals with their teams' fitness, breeds each subpopulation, and teams up anew.

        Args:
            migrants: whole teams; each member takes the place of the worst of its agent's subpopulation,
                credited with its team's fitness.
            credit: each member's own part of its team's fitness, in place of that.
        """
        del evaluations
        key_breed, key_teams = jax.random.split(key)
        hall = state.hall
        if hall is not None:
            best = jnp.argmax(fitness)
            hall = hall.enter(self._teams(state)[best], fitness[best])
        if credit is None:
            credit = jnp.broadcast_to(fitness[:, None], state.members.shape)
        subpopulations = self._breed(key_breed, state.subpopulations, self._credit(state, credit), migrants)
        size = subpopulations.genomes.shape[1]
        return CoevolutionState(subpopulations, self._team_up(key_teams, size, hall), hall)

    def standing(
        self, state: CoevolutionState, fitness: Float[Array, " population"]
    ) -> Float[Array, " population"]:
        """The fitness itself: a team is drawn for one evaluation."""
        return fitness

    def champion(self, state: CoevolutionState) -> Float[Array, " genes"]:
        """The team of each subpopulation's champion, whether or not these have ever played together."""
        return jax.vmap(self._breeder.champion)(state.subpopulations).reshape(-1)

    def champion_fitness(self, state: CoevolutionState) -> Float[Array, ""]:
        """What its members are credited with, on average: under leniency more than they reach together."""
        return jax.vmap(self._breeder.champion_fitness)(state.subpopulations).mean()

    def _breed(
        self,
        key: Key[Array, ""],
        subpopulations: GeneticState,
        credit: Float[Array, "agents individuals"],
        migrants: Migrants | None,
    ) -> GeneticState:
        """Each subpopulation's next generation, after it has taken in its member of every migrating team."""
        members = None
        if migrants is not None:
            teams = migrants.fitness.shape[0]
            members = jnp.swapaxes(migrants.genomes.reshape(teams, self._n_agents, -1), 0, 1)

        def of_agent(key, own, credit, genomes):
            arriving = None if migrants is None else dataclasses.replace(migrants, genomes=genomes)
            return self._breeder.next_generation(key, own, credit, migrants=arriving)

        keys = jax.random.split(key, self._n_agents)
        return jax.vmap(of_agent)(keys, subpopulations, credit, members)

    def _teams(self, state: CoevolutionState) -> Float[Array, "teams agents genes"]:
        everybody = state.subpopulations.genomes
        if state.hall is not None:
            everybody = jnp.concatenate([everybody, jnp.swapaxes(state.hall.genomes, 0, 1)], axis=1)
        return everybody[jnp.arange(self._n_agents), state.members]

    def _team_up(self, key: Key[Array, ""], size: int, hall: HallOfFame | None) -> Int[Array, "teams agents"]:
        """One team for each individual of a subpopulation, as often as each is to play."""
        key_living, key_hall, key_place, key_keep = jax.random.split(key, 4)
        # The order of random numbers is a random permutation, by a single sort.
        order = jax.random.uniform(key_living, (self.config.teams, size, self._n_agents))
        living = jnp.argsort(order, axis=1).astype(jnp.int32).reshape(-1, self._n_agents)
        if hall is None:
            return living
        config = self.config.hall_of_fame
        famous = size + hall.draw(key_hall, living.shape, config)
        fills = jax.random.bernoulli(key_place, config.share, living.shape) & hall.taken.any()
        # A team of the hall alone would tell nothing about the living.
        kept = jax.random.randint(key_keep, (living.shape[0],), 0, self._n_agents)
        fills &= ~jax.nn.one_hot(kept, self._n_agents, dtype=bool)
        return jnp.where(fills, famous, living).at[:size].set(living[:size])

    def _credit(
        self, state: CoevolutionState, fitness: Float[Array, "teams agents"]
    ) -> Float[Array, "agents individuals"]:
        """The largest, mean or smallest fitness that each individual had in the teams that it played in."""
        size = state.subpopulations.genomes.shape[1]

        def of_agent(
            members: Int[Array, " teams"], fitness: Float[Array, " teams"]
        ) -> Float[Array, " individuals"]:
            # Members of the hall are beyond the end, where a scatter drops them.
            if self.config.credit == "max":
                return jnp.full(size, -jnp.inf).at[members].max(fitness, mode="drop")
            if self.config.credit == "min":
                return jnp.full(size, jnp.inf).at[members].min(fitness, mode="drop")
            played = jnp.zeros(size).at[members].add(1.0, mode="drop")
            return jnp.zeros(size).at[members].add(fitness, mode="drop") / played

        return jax.vmap(of_agent, in_axes=1)(state.members, fitness)
