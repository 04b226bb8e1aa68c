"""Actors that learn primitive actions by gradient, each on one reward: the gradient half of many systems."""

import dataclasses
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Key

from skillcrew.envs.environment import Environment
from skillcrew.errors import UserError, unknown_name
from skillcrew.learners.td3 import TD3, Batch, TD3Config, TD3State
from skillcrew.learners.training import train_learners
from skillcrew.policies.memory import MemoryNetwork
from skillcrew.policies.team import ActorTeam
from skillcrew.replay import ReplayBuffer, Transitions, most_transitions, transitions_of
from skillcrew.rollout import Trajectories


@dataclasses.dataclass(frozen=True)
class ActorLearningConfig:
    """What actors learn from, and how."""

    reward: str = "team"
    """What each actor maximises: "team" for the team reward, "local" for the sum of its agent's local
    rewards, or the name of one of the environment's skills for that local reward alone."""
    updates: int = 100
    """Critic updates per actor and generation; a multiple of learner.policy_delay."""
    exploration_noise: float = 0.1
    """Standard deviation of the noise on primitive actions in the learner's own episodes (Fujimoto et al.
    2018)."""
    buffer_capacity: int = 300_000
    """Transitions that are kept; a transition is of one agent."""
    learner: TD3Config = dataclasses.field(default_factory=lambda: TD3Config(discount=0.99))
    """How actors learn. The discount looks as far as the team's task takes."""

    def __post_init__(self) -> None:
        for field in ("updates", "buffer_capacity"):
            if getattr(self, field) < 1:
                raise UserError(f"{field} = {getattr(self, field)}: give at least 1")
        if not self.exploration_noise >= 0:
            raise UserError(f"exploration_noise = {self.exploration_noise}: give a number of at least 0")
        if self.updates % self.learner.policy_delay:
            raise UserError(
                f"updates = {self.updates}: give a multiple of learner.policy_delay = "
                f"{self.learner.policy_delay}"
            )


class ActorLearningState(eqx.Module):
    """Leaves of both have a leading axis of actors: one for each agent, or a single one."""

    learners: TD3State
    experience: Any
    """The buffers' contents."""


class ActorLearning:
    """One learner for each agent, or one for all, that learn from what teams live.

    Args:
        n_actors: as many as there are agents, each learning from its agent's transitions alone; or 1,
            learning from everybody's.

    Raises:
        UserError: a reward that the environment lacks.
    """

    def __init__(self, env: Environment, config: ActorLearningConfig, n_actors: int):
        if config.reward not in ("team", "local", *env.skills):
            raise unknown_name("reward", config.reward, ("team", "local", *env.skills))
        self.config = config
        self._env = env
        self.n_actors = n_actors
        self._learner = TD3(config.learner, env.observation_size, env.action_size)
        self._buffer = ReplayBuffer(
            config.buffer_capacity // n_actors, env.observation_size, env.action_size, len(env.skills)
        )

    def init(self, key: Key[Array, ""]) -> ActorLearningState:
        """Random actors, empty buffers."""
        learners = jax.vmap(self._learner.init)(jax.random.split(key, self.n_actors))
        empty = self._buffer.init()
        experience = jax.tree.map(lambda leaf: jnp.stack([leaf] * self.n_actors), empty)
        return ActorLearningState(learners, experience)

    def actors(self, state: ActorLearningState) -> MemoryNetwork:
        """The actors as they stand, as networks that a team can act by."""
        return jax.vmap(MemoryNetwork.of_actor)(state.learners.actor)

    def team(self, state: ActorLearningState) -> ActorTeam:
        """The actors as they stand, without noise."""
        return ActorTeam(self.actors(state), self._env.n_agents)

    def learn(
        self, key: Key[Array, ""], state: ActorLearningState, lived: Trajectories
    ) -> tuple[ActorLearningState, dict[str, Array]]:
        """Takes in recorded worlds, then updates every actor.

        Returns:
            The new state, and metrics.
        """
        experience = jax.vmap(self._buffer.add)(state.experience, *self._by_actor(*transitions_of(lived)))
        config = self.config.learner
        shape = (config.policy_delay, config.batch_size)

        def draw(key: Key[Array, ""]) -> Batch:
            keys = jax.random.split(key, self.n_actors)
            drawn = jax.vmap(lambda held, k: self._buffer.sample(held, k, shape[0] * shape[1]))(
                experience, keys
            )
            drawn = jax.tree.map(lambda leaf: leaf.reshape(self.n_actors, *shape, *leaf.shape[2:]), drawn)
            reward = self._reward(drawn)
            return Batch(drawn.observation, drawn.action, reward, drawn.next_observation, drawn.terminated)

        learners, losses = train_learners(key, self._learner, state.learners, draw, self.config.updates)
        metrics = {name: loss.mean() for name, loss in losses.items()}
        metrics["transitions_held"] = jax.vmap(self._buffer.size)(experience).sum()
        return ActorLearningState(learners, experience), metrics

    def transitions(self, worlds: int) -> int:
        """Transitions that so many worlds give at most.

        Raises:
            UserError: more than the buffers hold.
        """
        return most_transitions(self._env, worlds, self.config.buffer_capacity)

    def transient_bytes(self, worlds: int) -> int:
        """Trajectories of so many worlds, their transitions as rows, and one more copy meanwhile."""
        return 3 * 4 * self.transitions(worlds) * self._buffer.width

    def _reward(self, drawn: Transitions) -> Float[Array, "actors delay batch"]:
        """The one number of each transition that actors maximise."""
        if self.config.reward == "team":
            return drawn.team_reward
        if self.config.reward == "local":
            return drawn.local_rewards.sum(-1)
        return drawn.local_rewards[..., self._env.skills.index(self.config.reward)]

    def _by_actor(
        self, transitions: Transitions, lived: Bool[Array, " items"]
    ) -> tuple[Transitions, Bool[Array, "actors own"]]:
        """Rows of all agents as each actor's own; agents vary fastest."""

        def split(leaf: Array) -> Array:
            return jnp.moveaxis(leaf.reshape(-1, self.n_actors, *leaf.shape[1:]), 1, 0)

        return jax.tree.map(split, transitions), split(lived)
