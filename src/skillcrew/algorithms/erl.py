"""ERL: Evolutionary Reinforcement Learning (Khadka and Tumer 2018; thesis, section 2.1.10).

A population of actors evolves on the team reward and fills a buffer; one actor learns by gradient from
that buffer and from noisy episodes of its own; now and then it migrates into the population.
"""

import dataclasses
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Int, Key

from skillcrew.algorithms.actor_learning import ActorLearning, ActorLearningConfig, ActorLearningState
from skillcrew.algorithms.algorithm import override
from skillcrew.algorithms.team_search import SearchConfig, TeamSearch
from skillcrew.envs.environment import Environment
from skillcrew.envs.joint import Joint
from skillcrew.errors import UserError
from skillcrew.evolution.evolver import Migrants
from skillcrew.policies.actor import Actor
from skillcrew.policies.memory import MemoryNetwork
from skillcrew.policies.population import GenomeCodec
from skillcrew.policies.team import ActorTeam, JointTeam, NoisyTeam
from skillcrew.rollout import Lineup, rollout


@dataclasses.dataclass(frozen=True)
class ERLConfig(SearchConfig, ActorLearningConfig):
    """Options of ERL."""

    learner_episodes: int = 1
    """Noisy episodes of the learner per generation, in the first of the population's worlds (ERL: 1)."""
    migration_period: int = 1
    """Generations between two migrations of the learner's actor into the population (ERL: 1 to 10)."""

    def __post_init__(self) -> None:
        SearchConfig.__post_init__(self)
        ActorLearningConfig.__post_init__(self)
        if not 1 <= self.learner_episodes <= self.episodes:
            raise UserError(
                f"learner_episodes = {self.learner_episodes}: give at least 1 and at most episodes = "
                f"{self.episodes}"
            )
        if self.migration_period < 1:
            raise UserError(f"migration_period = {self.migration_period}: give at least 1 generation")
        if self.evolver != "genetic":
            raise UserError(
                f"evolver = {self.evolver}: has nobody whose place a migrant could take; set it to genetic"
            )


class ERLState(eqx.Module):
    """All that goes from one generation to the next."""

    key: Key[Array, ""]
    search: Any
    """The evolver's: the population, and what is known of it."""
    actor: ActorLearningState
    generation: Int[Array, ""]
    environment_steps: Int[Array, ""]


class ERL:
    """A population of actors for the whole team evolves, and one that learns by gradient migrates into it.

    An actor sees all agents' observations and moves all of them. `ERL(env, population=10)` overrides fields
    of `ERLConfig`.

    Raises:
        UserError: an unknown field or reward, or a value that a field refuses.
    """

    name = "erl"
    label = "ERL"
    config_class = ERLConfig

    def __init__(self, env: Environment, config: ERLConfig | None = None, **overrides: Any):
        self.env = env
        self.config = override(self, config, overrides)
        self._joint = Joint(env)
        self._learning = ActorLearning(self._joint, self.config, n_actors=1)
        self._search = TeamSearch(self._joint, GenomeCodec(self._create_actor, 1), self.config)
        self._learning.transitions(self._worlds())

    def choices(self) -> tuple[str, ...]:
        """Nothing is chosen: one name, for the index 0 that every choice is."""
        return ("primitive_action",)

    def init(self, key: Key[Array, ""]) -> ERLState:
        """Random actors, an empty buffer."""
        key_search, key_actor, key = jax.random.split(key, 3)
        zero = jnp.zeros((), jnp.int32)
        return ERLState(key, self._search.init(key_search), self._learning.init(key_actor), zero, zero)

    def step(self, state: ERLState) -> tuple[ERLState, dict[str, Array]]:
        """One generation."""
        key, key_start, key_rollout, key_evolution, key_learn = jax.random.split(state.key, 5)
        config, population = self.config, self._search.worlds

        # The population and the learner live the same fresh episodes; the learner some of them with noise.
        start = self._search.start(key_start)
        learner = self._learning.team(state.actor)
        lineup = self._search.lineup(state.search, start, _make_team)
        lineup = lineup.beside(Lineup.of_team(learner, start))
        explorer = NoisyTeam(learner, config.exploration_noise)
        lineup = lineup.beside(Lineup.of_team(explorer, start.first(config.learner_episodes)))
        episodes, lived = rollout(self._joint, lineup, key_rollout)

        # The learner's actor takes the place of the worst; then the population breeds.
        generation = state.generation + 1
        own = episodes.worlds(slice(population, population + config.episodes))
        migrants = Migrants(
            genomes=self._search.encode(self._learning.actors(state.actor))[None],
            fitness=self._search.fitness(own, 1),
            arrive=generation % config.migration_period == 0,
        )
        search, measured = self._search.evolve(
            key_evolution, state.search, episodes.worlds(slice(population)), _make_team, migrants
        )

        # Everybody's experience is learned from.
        actor, losses = self._learning.learn(key_learn, state.actor, lived)

        steps = state.environment_steps + episodes.steps_lived() + measured.pop("race_steps", 0)
        fitness = {"learner_fitness": migrants.fitness[0], **measured}
        return ERLState(key, search, actor, generation, steps), {
            "environment_steps": steps,
            **fitness,
            **losses,
        }

    def team(self, state: ERLState) -> JointTeam:
        """The champion of the population."""
        return JointTeam(_make_team(self._search.champion(state.search)), self.env.n_agents)

    def transient_bytes(self) -> int:
        """What a generation takes beside the state."""
        return self._learning.transient_bytes(self._worlds())

    def _worlds(self) -> int:
        return self._search.worlds + self.config.episodes + self.config.learner_episodes

    def _create_actor(self, key: Key[Array, ""]) -> MemoryNetwork:
        joint = self._joint
        network = self.config.learner.network
        return MemoryNetwork.of_actor(Actor.create(key, joint.observation_size, joint.action_size, network))


def _make_team(actors: MemoryNetwork) -> ActorTeam:
    return ActorTeam(actors, 1)
