"""Evolution and gradients side by side: what ERL, MERL and CERL have in common.

A population evolves on the team reward. What it lives, and what noisy learners live beside it, is learned
from by gradient; now and then the learners migrate into the population, where they replace the worst.
"""

import dataclasses
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, Key

from skillcrew.algorithms.actor_learning import ActorLearning, ActorLearningConfig, ActorLearningState
from skillcrew.algorithms.algorithm import ActsDirectly
from skillcrew.algorithms.team_search import HOSTS, SearchConfig, TeamSearch
from skillcrew.envs.environment import Environment
from skillcrew.errors import UserError
from skillcrew.evolution.evolver import Migrants
from skillcrew.learners.dqn import DQNConfig
from skillcrew.learners.td3 import TD3Config
from skillcrew.policies.actor import Actor
from skillcrew.policies.memory import MemoryNetwork
from skillcrew.policies.network import NetworkConfig
from skillcrew.policies.population import GenomeCodec
from skillcrew.policies.team import ActorTeam, NoisyTeam
from skillcrew.rollout import Lineup, Start, count_steps, rollout


@dataclasses.dataclass(frozen=True)
class MigrationConfig(SearchConfig, ActorLearningConfig):
    """How a population and learners live side by side."""

    learner_episodes: int = 1
    """Noisy episodes of learners per generation, each in a fresh world (ERL: 1)."""
    migration_period: int = 1
    """Generations between two migrations of learners into the population (ERL: 1 to 10)."""
    learner: TD3Config = dataclasses.field(
        default_factory=lambda: TD3Config(discount=0.99, network=NetworkConfig(hidden=(32,)))
    )
    """How actors learn. The network is also what evolves, and large ones evolve slowly."""
    dqn: DQNConfig = dataclasses.field(
        default_factory=lambda: DQNConfig(discount=0.99, network=NetworkConfig(hidden=(32,)))
    )
    """How they learn where actions are discrete."""

    def __post_init__(self) -> None:
        SearchConfig.__post_init__(self)
        ActorLearningConfig.__post_init__(self)
        for field, unit in (("learner_episodes", "episode"), ("migration_period", "generation")):
            if getattr(self, field) < 1:
                raise UserError(f"{field} = {getattr(self, field)}: give at least 1 {unit}")
        if self.evolver not in HOSTS:
            raise UserError(
                f"evolver = {self.evolver}: has nobody whose place a migrant could take; set it to "
                + " or ".join(HOSTS)
            )

    def unused(self, env: Environment) -> set[str]:
        """Names of the sections that are not looked at in such an environment."""
        return SearchConfig.unused(self, env) | ActorLearningConfig.unused(self, env)


class MigrationState(eqx.Module):
    """All that goes from one generation to the next."""

    key: Key[Array, ""]
    search: Any
    """The evolver's: the population, and what is known of it."""
    learning: ActorLearningState
    generation: Int[Array, ""]
    environment_steps: Int[Array, ""]


class Migration:
    """One generation of a population and of learners that migrate into it.

    Args:
        env: as the actors see it.
        learning: its actors are one learner's team after the other's.
        networks: actors of a team: one for each agent, or a single one that all share.
        heads: as those of the learners' actors.

    Raises:
        UserError: more transitions than buffers hold, or migrants for whom there is no place.
    """

    def __init__(self, env: Environment, config: Any, learning: ActorLearning, networks: int, heads: int = 0):
        self.config = config
        self._env = env
        self._heads = heads
        self._learning = learning
        self._networks = networks
        self.learners = learning.n_actors // networks
        self._search = TeamSearch(env, GenomeCodec(self._create_actor, networks), config)
        self._learning.reserve(self._worlds())
        if config.population <= self.learners:
            raise UserError(
                f"population = {config.population}: no larger than the {self.learners} learners that migrate "
                "into it; raise it"
            )

    def init(self, key: Key[Array, ""]) -> MigrationState:
        """Random actors, empty buffers."""
        key_search, key_learners, key = jax.random.split(key, 3)
        zero = jnp.zeros((), jnp.int32)
        return MigrationState(
            key, self._search.init(key_search), self._learning.init(key_learners), zero, zero
        )

    def generation(
        self, state: MigrationState, explorer: Int[Array, " slots"]
    ) -> tuple[MigrationState, dict[str, Array], Float[Array, " slots"]]:
        """Everybody lives; learners migrate; the population breeds; learners learn.

        Args:
            explorer: which learner lives each noisy episode.

        Returns:
            The new state, metrics, and the team return of each noisy episode.
        """
        key, key_start, key_worlds, key_rollout, key_evolution, key_learn = jax.random.split(state.key, 6)
        config = self.config
        learners = self._teams(state.learning)

        # The population and the learners live the same fresh episodes; some learners explore in others.
        start = self._search.start(key_start)
        lineup = self._search.lineup(state.search, start, self._make_team)
        lineup = lineup.beside(Lineup.of_teams(self._make_team, learners, self.learners, start))
        exploring = jax.tree.map(lambda leaf: leaf[explorer], learners)
        elsewhere = Start.draw(self._env, key_worlds, config.learner_episodes)
        lineup = lineup.beside(Lineup.of_pairs(self._make_explorer, exploring, elsewhere))
        episodes, trajectories = rollout(self._env, lineup, key_rollout)
        ends = (self._search.worlds, self._search.worlds + self.learners * start.worlds)

        # In their generations the learners take the places of the worst; then the population breeds.
        generation = state.generation + 1
        migrants = Migrants(
            genomes=jax.vmap(self._search.encode)(learners),
            fitness=self._search.fitness(episodes.worlds(slice(*ends)), self.learners),
            arrive=generation % config.migration_period == 0,
        )
        search, measured = self._search.evolve(
            key_evolution, state.search, episodes.worlds(slice(ends[0])), self._make_team, migrants
        )

        # Everybody's experience is learned from.
        learning, losses = self._learning.learn(key_learn, state.learning, trajectories)

        raced = measured.pop("race_steps", 0)
        steps = count_steps(state.environment_steps, episodes.steps(), raced)
        state = MigrationState(key, search, learning, generation, steps)
        metrics = {
            "environment_steps": steps,
            "learner_fitness": migrants.fitness.max(),
            **measured,
            **losses,
        }
        return state, metrics, episodes.worlds(slice(ends[1], None)).team_return()

    def champion(self, state: MigrationState) -> ActorTeam:
        """The team to report: the population's."""
        return self._make_team(self._search.champion(state.search))

    def transient_bytes(self) -> int:
        """What a generation takes beside the state."""
        return self._learning.transient_bytes(self._worlds())

    def _teams(self, learning: ActorLearningState) -> MemoryNetwork:
        """The learners' actors; leaves have leading axes [learners, networks]."""

        def by_team(leaf: Array) -> Array:
            return leaf.reshape(self.learners, self._networks, *leaf.shape[1:])

        return jax.tree.map(by_team, self._learning.actors(learning))

    def _worlds(self) -> int:
        config = self.config
        return self._search.worlds + self.learners * config.episodes + config.learner_episodes

    def _make_team(self, actors: MemoryNetwork) -> ActorTeam:
        return ActorTeam(actors, self._env.n_agents, self._env.choices)

    def _make_explorer(self, actors: MemoryNetwork) -> NoisyTeam:
        return NoisyTeam(self._make_team(actors), self.config.exploration_noise, self._env.choices)

    def _create_actor(self, key: Key[Array, ""]) -> MemoryNetwork:
        env, network = self._env, self._learning.network
        actor = Actor.create(key, env.observation_size, env.action_size, network, self._heads)
        return MemoryNetwork.of_actor(actor)


class OneLearnerMigrates(ActsDirectly):
    """What ERL and MERL do in a generation; who acts, learns and evolves is theirs to say."""

    config: Any
    _migration: Migration

    def init(self, key: Key[Array, ""]) -> MigrationState:
        """Random actors, empty buffers."""
        return self._migration.init(key)

    def step(self, state: MigrationState) -> tuple[MigrationState, dict[str, Array]]:
        """One generation; the one learner, or team of learners, lives all noisy episodes."""
        explorer = jnp.zeros(self.config.learner_episodes, jnp.int32)
        state, metrics, _ = self._migration.generation(state, explorer)
        return state, metrics

    def transient_bytes(self) -> int:
        """What a generation takes beside the state."""
        return self._migration.transient_bytes()
