"""Agents that learn by gradient while nothing evolves: a few noisy episodes, then updates, over and over."""

import dataclasses
from typing import Any, Literal

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Int, Key

from skillcrew.algorithms.actor_learning import ActorLearning, ActorLearningState
from skillcrew.algorithms.algorithm import ActsDirectly, agents_differ, override
from skillcrew.credit.difference import credited
from skillcrew.envs.environment import Environment
from skillcrew.errors import UserError, unknown_name
from skillcrew.policies.team import ActorTeam
from skillcrew.rollout import Start, count_steps, rollout


@dataclasses.dataclass(frozen=True)
class LearningAloneConfig:
    """Options of learners beside which nothing evolves."""

    sharing: Literal["agent", "team"] = "agent"
    """Whose an actor is: "agent" gives each agent its own, which learns from that agent's transitions alone;
    "team" one to all, which learns from everybody's."""
    episodes: int = 10
    """Episodes per generation, all with exploration noise."""

    def __post_init__(self) -> None:
        if self.sharing not in ("agent", "team"):
            raise unknown_name("sharing", str(self.sharing), ("agent", "team"))
        if self.episodes < 1:
            raise UserError(f"episodes = {self.episodes}: give at least 1")


class LearningAloneState(eqx.Module):
    """All that goes from one generation to the next."""

    key: Key[Array, ""]
    actors: ActorLearningState
    generation: Int[Array, ""]
    environment_steps: Int[Array, ""]


class LearningAlone(ActsDirectly):
    """A generation of such learners; algorithms say who they are.

    Raises:
        UserError: an unknown field or reward, or a value that a field refuses.
    """

    name: str
    config_class: Any

    def __init__(self, env: Environment, config: Any = None, **overrides: Any):
        self.env = env
        self._check_actions()
        self.config = override(self, config, overrides)
        if env.types and self.config.sharing == "team":
            raise agents_differ(env)
        self._lived_in = credited(env, self.config.reward)
        self._actors = self._learning(env.n_agents if self.config.sharing == "agent" else 1)
        self._actors.reserve(self.config.episodes)

    def init(self, key: Key[Array, ""]) -> LearningAloneState:
        """Random actors, empty buffers."""
        key_actors, key = jax.random.split(key)
        zero = jnp.zeros((), jnp.int32)
        return LearningAloneState(key, self._actors.init(key_actors), zero, zero)

    def step(self, state: LearningAloneState) -> tuple[LearningAloneState, dict[str, Array]]:
        """One generation: a few episodes, then updates."""
        key, key_start, key_rollout, key_learn, key_explore = jax.random.split(state.key, 5)
        start = Start.draw(self._lived_in, key_start, self.config.episodes)
        explorers = self._actors.explorers(key_explore, state.actors, start)
        episodes, trajectories = rollout(self._lived_in, explorers, key_rollout)
        actors, measured = self._actors.learn(key_learn, state.actors, trajectories)
        steps = count_steps(state.environment_steps, episodes.steps())
        returns = episodes.team_return()
        fitness = {"fitness_best": returns.max(), "fitness_mean": returns.mean()}
        after = LearningAloneState(key, actors, state.generation + 1, steps)
        return after, {"environment_steps": steps, **fitness, **measured}

    def team(self, state: LearningAloneState) -> ActorTeam:
        """The actors as they stand."""
        return self._actors.team(state.actors)

    def transient_bytes(self) -> int:
        """What a generation takes beside the state."""
        return self._actors.transient_bytes(self.config.episodes)

    def _learning(self, n_actors: int) -> ActorLearning:
        """How they learn in the world that they live in."""
        return ActorLearning(self._lived_in, self.config, n_actors)

    def _check_actions(self) -> None:
        """Refuses an environment whose actions they cannot give."""
