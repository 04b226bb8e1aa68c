"""EA: the evolutionary algorithm of MADyS on primitive actions (thesis, section 4.2)."""

import dataclasses
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Int, Key

from skillcrew.algorithms.algorithm import ActsDirectly, override
from skillcrew.algorithms.team_search import SearchConfig, TeamSearch
from skillcrew.envs.environment import Environment
from skillcrew.envs.padded import types_of_agents
from skillcrew.policies.memory import MemoryNetwork, PolicyConfig, dealt_out
from skillcrew.policies.population import GenomeCodec
from skillcrew.policies.team import ActorTeam
from skillcrew.rollout import count_steps, rollout


@dataclasses.dataclass(frozen=True)
class EAConfig(SearchConfig):
    """Options of EA."""

    actor: PolicyConfig = dataclasses.field(default_factory=PolicyConfig)
    """The actors' network."""


class EAState(eqx.Module):
    """All that goes from one generation to the next."""

    key: Key[Array, ""]
    search: Any
    """The evolver's: the population, and what is known of it."""
    generation: Int[Array, ""]
    environment_steps: Int[Array, ""]


class EA(ActsDirectly):
    """Teams of actors evolve on the team reward; nothing learns by gradient, and there are no skills.

    `EA(env, population=60)` overrides fields of `EAConfig`.

    Raises:
        UserError: an unknown field, or a value that a field refuses.
    """

    name = "ea"
    label = "EA"
    config_class = EAConfig

    def __init__(self, env: Environment, config: EAConfig | None = None, **overrides: Any):
        self.env = env
        self.config = override(self, config, overrides)
        self._world = self._lived_in()
        codec = GenomeCodec(self._create_actor, self.config.actor.networks(env))
        self._search = TeamSearch(self._world, codec, self.config)

    def init(self, key: Key[Array, ""]) -> EAState:
        """Random teams."""
        key_teams, key = jax.random.split(key)
        zero = jnp.zeros((), jnp.int32)
        return EAState(key, self._search.init(key_teams), zero, zero)

    def step(self, state: EAState) -> tuple[EAState, dict[str, Array]]:
        """One generation."""
        key, key_start, key_rollout, key_evolution = jax.random.split(state.key, 4)
        start = self._search.start(key_start)
        teams = self._search.lineup(state.search, start, self._make_team)
        is_credited = self._world is not self.env
        recorded = slice(None) if is_credited else slice(0)
        episodes, trajectories = rollout(self._world, teams, key_rollout, recorded=recorded)
        search, measured = self._search.evolve(
            key_evolution,
            state.search,
            episodes,
            self._make_team,
            credit=trajectories.local_return(-1) if is_credited else None,
        )
        raced = measured.pop("race_steps", 0)
        steps = count_steps(state.environment_steps, episodes.steps(), raced)
        return EAState(key, search, state.generation + 1, steps), {"environment_steps": steps, **measured}

    def _lived_in(self) -> Environment:
        """The world that teams live in; one with credits for whoever is bred for these."""
        return self.env

    def team(self, state: EAState) -> ActorTeam:
        """The champion of the population."""
        return self._make_team(self._search.champion(state.search))

    def transient_bytes(self) -> int:
        """A generation's observations and what the networks make of them, for one step."""
        width = self.env.observation_size + sum(self.config.actor.hidden) + 4 * self.config.actor.memory
        return 4 * self._search.worlds * self.env.n_agents * width

    def _make_team(self, actors: MemoryNetwork) -> ActorTeam:
        actors = dealt_out(actors, types_of_agents(self.env), self.config.actor)
        return ActorTeam(actors, self.env.n_agents, self.env.choices)

    def _create_actor(self, key: Key[Array, ""]) -> MemoryNetwork:
        return MemoryNetwork.create(key, self.env.observation_size, self.env.action_size, self.config.actor)
