"""TD3 and DDPG on their own: agents that learn side by side, each as if the others were the world."""

import dataclasses
from typing import Any, Literal

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Int, Key

from skillcrew.algorithms.actor_learning import ActorLearning, ActorLearningConfig, ActorLearningState
from skillcrew.algorithms.algorithm import ActsDirectly, agents_differ, override
from skillcrew.credit.difference import credited
from skillcrew.envs.environment import Environment
from skillcrew.errors import UserError, unknown_name
from skillcrew.learners.td3 import TD3Config
from skillcrew.policies.team import ActorTeam, NoisyTeam
from skillcrew.rollout import Lineup, Start, rollout


@dataclasses.dataclass(frozen=True)
class IndependentTD3Config(ActorLearningConfig):
    """Options of independent learners."""

    sharing: Literal["agent", "team"] = "agent"
    """Whose an actor is: "agent" gives each agent its own, which learns from that agent's transitions alone;
    "team" one to all, which learns from everybody's."""
    episodes: int = 10
    """Episodes per generation, all with exploration noise."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.sharing not in ("agent", "team"):
            raise unknown_name("sharing", str(self.sharing), ("agent", "team"))
        if self.episodes < 1:
            raise UserError(f"episodes = {self.episodes}: give at least 1")


@dataclasses.dataclass(frozen=True)
class IndependentDDPGConfig(IndependentTD3Config):
    """Options of independent learners, with DDPG's: one critic, no delay, no target noise."""

    learner: TD3Config = dataclasses.field(default_factory=lambda: TD3Config.ddpg(discount=0.99))
    """How actors learn."""


class IndependentState(eqx.Module):
    """All that goes from one generation to the next."""

    key: Key[Array, ""]
    actors: ActorLearningState
    generation: Int[Array, ""]
    environment_steps: Int[Array, ""]


class IndependentTD3(ActsDirectly):
    """Each agent learns by TD3 on a reward of its own or the team's; nothing evolves.

    `IndependentTD3(env, reward="local")` overrides fields of `IndependentTD3Config`.

    Raises:
        UserError: an unknown field or reward, or a value that a field refuses.
    """

    name = "td3"
    label = "TD3"
    config_class: Any = IndependentTD3Config

    def __init__(self, env: Environment, config: Any = None, **overrides: Any):
        self.env = env
        self._check_actions()
        self.config = override(self, config, overrides)
        if env.types and self.config.sharing == "team":
            raise agents_differ(env)
        n_actors = env.n_agents if self.config.sharing == "agent" else 1
        self._lived_in = credited(env, self.config.reward)
        self._actors = ActorLearning(self._lived_in, self.config, n_actors)
        self._actors.reserve(self.config.episodes)

    def init(self, key: Key[Array, ""]) -> IndependentState:
        """Random actors, empty buffers."""
        key_actors, key = jax.random.split(key)
        zero = jnp.zeros((), jnp.int32)
        return IndependentState(key, self._actors.init(key_actors), zero, zero)

    def step(self, state: IndependentState) -> tuple[IndependentState, dict[str, Array]]:
        """One generation: a few episodes, then updates."""
        key, key_start, key_rollout, key_learn = jax.random.split(state.key, 4)
        explorers = NoisyTeam(self.team(state), self.config.exploration_noise, self.env.choices)
        start = Start.draw(self._lived_in, key_start, self.config.episodes)
        episodes, trajectories = rollout(self._lived_in, Lineup.of_team(explorers, start), key_rollout)
        actors, measured = self._actors.learn(key_learn, state.actors, trajectories)
        steps = state.environment_steps + episodes.steps()
        returns = episodes.team_return()
        fitness = {"fitness_best": returns.max(), "fitness_mean": returns.mean()}
        after = IndependentState(key, actors, state.generation + 1, steps)
        return after, {"environment_steps": steps, **fitness, **measured}

    def team(self, state: IndependentState) -> ActorTeam:
        """The actors as they stand."""
        return self._actors.team(state.actors)

    def _check_actions(self) -> None:
        if self.env.choices:
            raise UserError(
                f"{self.name}: gives continuous actions, and those of {self.env.name} are discrete; use dqn, "
                "madys, madys-plus, mfl, ea, ccea, merl, erl or cerl"
            )

    def transient_bytes(self) -> int:
        """What a generation takes beside the state."""
        return self._actors.transient_bytes(self.config.episodes)


class IndependentDDPG(IndependentTD3):
    """Each agent learns by DDPG on a reward of its own or the team's; nothing evolves."""

    name = "ddpg"
    label = "DDPG"
    config_class = IndependentDDPGConfig


class IndependentDQN(IndependentTD3):
    """Each agent learns by DQN on a reward of its own or the team's; for discrete actions."""

    name = "dqn"
    label = "DQN"

    def _check_actions(self) -> None:
        if not self.env.choices:
            raise UserError(
                f"dqn: picks one of several actions, and those of {self.env.name} are continuous; use td3 or "
                "ddpg"
            )
