"""The evolutionary half of every algorithm: a population of teams lives, is ranked, and evolves."""

import dataclasses
from collections.abc import Callable
from typing import Any, Literal

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, Key, PyTree

from skillcrew.envs.environment import Environment, Lessons
from skillcrew.errors import UserError, unknown_name
from skillcrew.evolution.evolver import Evolver
from skillcrew.evolution.genetic import EvolutionConfig, GeneticAlgorithm
from skillcrew.evolution.selection import rank
from skillcrew.evolution.strategy import EvolutionStrategy, StrategyConfig
from skillcrew.policies.population import GenomeCodec
from skillcrew.policies.team import Team
from skillcrew.rollout import Episodes, Lineup, Start, rollout


@dataclasses.dataclass(frozen=True)
class RaceConfig:
    """The best few live more episodes before they are ranked, which count as environment steps."""

    finalists: int = 0
    """Teams that live them; 0 for no race."""
    episodes: int = 20
    """More episodes of each finalist, without exploration noise, the same for all of them."""

    def __post_init__(self) -> None:
        if self.finalists < 0:
            raise UserError(f"race.finalists = {self.finalists}: give a number of teams, or 0 for no race")
        if self.episodes < 1:
            raise UserError(f"race.episodes = {self.episodes}: give at least 1")


@dataclasses.dataclass(frozen=True)
class CurriculumConfig:
    """Whether teams begin with easier versions of the task, if the environment has any."""

    enabled: bool = False
    """True goes through the environment's lessons, the task itself last. Champions are always scored on
    the task itself."""
    success: float = 0.5
    """Share of the population's episodes with the lesson's task done at which the next lesson begins."""
    smoothing: float = 0.8
    """That share is measured on few episodes; this is the weight of its past in the running average."""

    def __post_init__(self) -> None:
        if not 0 < self.success <= 1:
            raise UserError(f"curriculum.success = {self.success}: give a share above 0 and up to 1")
        if not 0 <= self.smoothing < 1:
            raise UserError(f"curriculum.smoothing = {self.smoothing}: give a number from 0 to below 1")


@dataclasses.dataclass(frozen=True)
class SearchConfig:
    """How teams are evaluated, and how they evolve."""

    population: int = 40
    """Teams (M)."""
    episodes: int = 5
    """Evaluation episodes per team and generation (num_envs); all teams meet the same ones. Few, for
    lineage averages make up for the noise: 0.40 M steps brought champions to 0.64 with 5, to 0.17
    with 10 (means over 5 seeds)."""
    fitness_discount: float = 0.98
    """Discount per step of the team reward in a team's fitness. 1 is the thesis's plain return; below 1,
    of two teams that both succeed the quicker one ranks higher. Success itself is scored without it. On
    two sets of trained skills of rover-t2-c1, 1 M steps brought champions to 0.916 and 0.908 with 1, to
    0.957 and 0.928 with 0.98 (means over 15 to 20 runs)."""
    evolver: Literal["genetic", "strategy"] = "genetic"
    """What the next generation is made by: "genetic" (Algorithm 1) breeds the best, "strategy" moves the
    mean of a cloud of teams up their fitness."""
    evolution: EvolutionConfig = dataclasses.field(default_factory=EvolutionConfig)
    """How the genetic algorithm breeds."""
    strategy: StrategyConfig = dataclasses.field(default_factory=StrategyConfig)
    """How the evolution strategy moves."""
    race: RaceConfig = dataclasses.field(default_factory=RaceConfig)
    """Whether the best few are scored again before they are ranked."""
    curriculum: CurriculumConfig = dataclasses.field(default_factory=CurriculumConfig)
    """Whether the task begins easier than it is."""

    def __post_init__(self) -> None:
        for field in ("population", "episodes"):
            if getattr(self, field) < 1:
                raise UserError(f"{field} = {getattr(self, field)}: give at least 1")
        if not 0 < self.fitness_discount <= 1:
            raise UserError(
                f"fitness_discount = {self.fitness_discount}: give a number above 0 and up to 1 (no discount)"
            )
        if self.evolver not in ("genetic", "strategy"):
            raise unknown_name("evolver", str(self.evolver), ("genetic", "strategy"))
        (self.evolution if self.evolver == "genetic" else self.strategy).check_population(self.population)
        if self.race.finalists and self.evolver == "strategy":
            raise UserError(
                f"race.finalists = {self.race.finalists}: an evolution strategy weighs every team alike, so "
                "a race has nothing to decide; set race.finalists to 0 or evolver to genetic"
            )
        if self.race.finalists > self.population:
            raise UserError(
                f"race.finalists = {self.race.finalists}: above population = {self.population}; lower it"
            )


class SearchState(eqx.Module):
    """The population, what is known of it, and how far the curriculum has come."""

    evolver: Any
    lesson: Int[Array, ""]
    """Index into the environment's lessons; 0 without a curriculum."""
    success: Float[Array, ""]
    """Running average of the share of the lesson's episodes that were completed."""


class TeamSearch:
    """A population of teams that lives the same fresh episodes each generation, and evolves.

    Args:
        env: with lessons, if the configuration asks for a curriculum.
        codec: draws a team's networks, and turns genomes into them.
        config: see there.

    Raises:
        UserError: a curriculum is asked for and the environment has no lessons.
    """

    def __init__(self, env: Environment, codec: GenomeCodec, config: SearchConfig):
        self.config = config
        self._env = env
        self._codec = codec
        self._evolver: Evolver = (
            GeneticAlgorithm(config.evolution)
            if config.evolver == "genetic"
            else EvolutionStrategy(config.strategy)
        )
        self._lessons: Lessons | None = _lessons(env) if config.curriculum.enabled else None

    @property
    def worlds(self) -> int:
        """Worlds that the population lives in."""
        return self.config.population * self.config.episodes

    def init(self, key: Key[Array, ""]) -> SearchState:
        """A random population, at the first lesson."""
        evolver = self._evolver.init(key, self._codec.create, self.config.population)
        return SearchState(evolver, jnp.zeros((), jnp.int32), jnp.zeros(()))

    def start(self, key: Key[Array, ""], state: SearchState, episodes: int | None = None) -> Start:
        """Fresh episodes, by default as many as each team lives, of the present lesson."""
        start = Start.draw(self._env, key, episodes or self.config.episodes)
        if self._lessons is None:
            return start
        return dataclasses.replace(start, state=self._lessons.at_lesson(start.state, state.lesson))

    def lineup(self, state: SearchState, start: Start, make_team: Callable[[PyTree], Team]) -> Lineup:
        """Every team of the population in each of the worlds, team by team."""
        return self._lineup(self._evolver.genomes(state.evolver), start, make_team)

    def champion(self, state: SearchState) -> PyTree:
        """The networks of the team to report."""
        return self._codec.decode(self._evolver.champion(state.evolver))

    def evolve(
        self,
        key: Key[Array, ""],
        state: SearchState,
        episodes: Episodes,
        make_team: Callable[[PyTree], Team],
    ) -> tuple[SearchState, dict[str, Array]]:
        """Ranks the teams by the episodes of their lineup, after a race if there is one, and breeds.

        Returns:
            The new state, and metrics, among them `race_steps`: environment steps of the race.
        """
        returns = episodes.team_return(self.config.fitness_discount)
        fitness = returns.reshape(self.config.population, -1).mean(1)
        metrics = {"fitness_best": fitness.max(), "fitness_mean": fitness.mean()}
        evaluations = jnp.ones(self.config.population)
        if self.config.race.finalists:
            key, key_race = jax.random.split(key)
            fitness, evaluations, metrics["race_steps"] = self._race(key_race, state, fitness, make_team)
        evolver = self._evolver.next_generation(key, state.evolver, fitness, evaluations)
        metrics["champion_fitness"] = self._evolver.champion_fitness(evolver)
        state = SearchState(evolver, state.lesson, state.success)
        if self._lessons is not None:
            state = self._next_lesson(state, episodes.completed(), len(self._lessons.lessons))
            metrics["lesson"] = state.lesson
        return state, metrics

    def _lineup(
        self, genomes: Float[Array, "teams genes"], start: Start, make_team: Callable[[PyTree], Team]
    ) -> Lineup:
        networks = jax.vmap(self._codec.decode)(genomes)
        return Lineup.of_teams(make_team, networks, genomes.shape[0], start)

    def _race(
        self,
        key: Key[Array, ""],
        state: SearchState,
        fitness: Float[Array, " population"],
        make_team: Callable[[PyTree], Team],
    ) -> tuple[Float[Array, " population"], Float[Array, " population"], Int[Array, ""]]:
        """Fitness with the finalists' further episodes, the evaluations it rests on, and the race's steps."""
        race = self.config.race
        key_start, key_rollout = jax.random.split(key)
        finalists = rank(self._evolver.standing(state.evolver, fitness))[: race.finalists]
        start = self.start(key_start, state, race.episodes)
        lineup = self._lineup(self._evolver.genomes(state.evolver)[finalists], start, make_team)
        episodes, _ = rollout(self._env, lineup, key_rollout)
        more = episodes.team_return(self.config.fitness_discount).reshape(race.finalists, -1).mean(1)
        share = self.config.episodes / (self.config.episodes + race.episodes)
        fitness = fitness.at[finalists].set(share * fitness[finalists] + (1 - share) * more)
        evaluations = jnp.ones_like(fitness).at[finalists].set(1 / share)
        return fitness, evaluations, episodes.steps_lived()

    def _next_lesson(
        self, state: SearchState, completed: Bool[Array, " worlds"], lessons: int
    ) -> SearchState:
        """Goes on to the next lesson once the population does well enough in this one."""
        config = self.config.curriculum
        success = config.smoothing * state.success + (1 - config.smoothing) * completed.mean(
            dtype=jnp.float32
        )
        passed = (success >= config.success) & (state.lesson < lessons - 1)
        return SearchState(
            self._evolver.forget(state.evolver, passed),
            state.lesson + passed.astype(jnp.int32),
            jnp.where(passed, 0.0, success),
        )


def _lessons(env: Environment) -> Lessons:
    if not isinstance(env, Lessons):
        raise UserError(
            f"curriculum.enabled = True: {env.name} has no lessons to begin with; switch it off, or give "
            "the environment `lessons` and `at_lesson`"
        )
    return env
