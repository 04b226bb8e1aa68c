"""Actors that learn primitive actions by gradient, each on one reward: the gradient half of many systems."""

import dataclasses
import math
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Key

from skillcrew.credit.reward import LearnedReward
from skillcrew.envs.environment import Environment
from skillcrew.errors import UserError
from skillcrew.learners.batch import Batch
from skillcrew.learners.dqn import DQNConfig
from skillcrew.learners.learner import Learner, LearnerState, make_learner, unused_learner
from skillcrew.learners.td3 import TD3Config
from skillcrew.learners.training import round_bytes, train_learners
from skillcrew.policies.memory import MemoryNetwork
from skillcrew.policies.network import NetworkConfig
from skillcrew.policies.team import ActorTeam, NoisyTeam
from skillcrew.replay import ReplayBuffer, Transitions, capacity_for, most_transitions, transitions_of
from skillcrew.rollout import Lineup, Start, Trajectories


@dataclasses.dataclass(frozen=True)
class LearningConfig:
    """What actors learn from, and how much, whatever their critics see."""

    reward: str = "team"
    """What each actor maximises: "team", "local" for the sum of its agent's local rewards, skills joined by +
    for the sum of those; where nothing evolves also its agent's part of the team's: "D" or "D++"."""
    task_ends_value: bool = True
    """Whether an actor's value ends where the team's task is done, as the episode does. On a dense local
    reward that teaches actors to put off the end of the task; see `SkillConfig.task_ends_skills`."""
    updates: int = 100
    """Critic updates per actor and generation; a multiple of learner.policy_delay."""
    exploration_noise: float = 0.1
    """Standard deviation of the noise on primitive actions in the learner's own episodes (Fujimoto et al.
    2018); how likely each discrete action is a random one."""
    buffer_capacity: int | None = None
    """Transitions that are kept, of all actors together; a transition is of one agent. Default: 300,000, or
    those of two generations where they are more."""
    learner: TD3Config = dataclasses.field(default_factory=lambda: TD3Config(discount=0.99))
    """How actors learn. The discount looks as far as the team's task takes."""

    def __post_init__(self) -> None:
        for field in ("updates", "buffer_capacity"):
            value = getattr(self, field)
            if value is not None and value < 1:
                raise UserError(f"{field} = {value}: give at least 1")
        if not self.exploration_noise >= 0:
            raise UserError(f"exploration_noise = {self.exploration_noise}: give a number of at least 0")
        if self.updates % self.learner.policy_delay:
            raise UserError(
                f"updates = {self.updates}: give a multiple of learner.policy_delay = "
                f"{self.learner.policy_delay}"
            )


@dataclasses.dataclass(frozen=True)
class ActorLearningConfig(LearningConfig):
    """What actors learn from, and how, each with critics of its own view."""

    dqn: DQNConfig = dataclasses.field(default_factory=lambda: DQNConfig(discount=0.99))
    """How they learn where actions are discrete."""

    def unused(self, env: Environment) -> set[str]:
        """The name of the section of the learner that does not suit the environment's actions."""
        return {unused_learner(env.choices)}


class ActorLearningState(eqx.Module):
    """All that learners know and learn from."""

    learners: LearnerState
    """Leaves have a leading axis of actors."""
    experience: Any
    """The buffers' contents; leaves have a leading axis of buffers."""


class ActorLearning:
    """Learners side by side: one for each agent, one for all, or several that differ in discount.

    Args:
        n_actors: as many as there are agents, each learning from its agent's transitions alone; or 1,
            learning from everybody's.
        discounts: instead of `learner.discount`, that of each of several actors which all learn from one
            buffer of everybody's transitions.
        heads: agents of which each has a last layer of its own; see `Actor.create`.

    Raises:
        UserError: a reward that the environment lacks.
    """

    _agents_per_row = 1
    """How many agents' transitions stand side by side in a row of the buffer."""

    def __init__(
        self,
        env: Environment,
        config: Any,
        n_actors: int = 1,
        discounts: tuple[float, ...] | None = None,
        heads: int = 0,
    ):
        self.config = config
        self._env = env
        self._reward = LearnedReward(env, config.reward)
        self._discounts = discounts
        self.n_actors = len(discounts) if discounts else n_actors
        self._n_buffers = 1 if discounts else n_actors
        self._learner = self._make_learner(heads)
        self.reserve(0)

    def _make_learner(self, heads: int) -> Learner:
        config, env = self.config, self._env
        return make_learner(
            config.learner, config.dqn, env.observation_size, env.action_size, env.choices, heads
        )

    def init(self, key: Key[Array, ""]) -> ActorLearningState:
        """Random actors, empty buffers."""
        learners = jax.vmap(self._learner.init)(jax.random.split(key, self.n_actors))
        empty = self._buffer.init()
        experience = jax.tree.map(lambda leaf: jnp.stack([leaf] * self._n_buffers), empty)
        return ActorLearningState(learners, experience)

    @property
    def network(self) -> NetworkConfig:
        """Of the actors."""
        return self._learner.config.network

    def actors(self, state: ActorLearningState) -> MemoryNetwork:
        """The actors as they stand, as networks that a team can act by."""
        return jax.vmap(MemoryNetwork.of_actor)(state.learners.actor)

    def team(self, state: ActorLearningState) -> ActorTeam:
        """The actors as they stand, without noise."""
        return ActorTeam(self.actors(state), self._env.n_agents, self._env.choices)

    def explorers(self, key: Key[Array, ""], state: ActorLearningState, start: Start) -> Lineup:
        """The actors in all worlds, with noise."""
        del key  # Everybody has one actor.
        noisy = NoisyTeam(self.team(state), self.config.exploration_noise, self._env.choices)
        return Lineup.of_team(noisy, start)

    def learn(
        self, key: Key[Array, ""], state: ActorLearningState, trajectories: Trajectories
    ) -> tuple[ActorLearningState, dict[str, Array]]:
        """Takes in recorded worlds, then updates every actor.

        Returns:
            The new state, and metrics.
        """
        rows = self._by_buffer(*self._rows_of(trajectories))
        experience = jax.vmap(self._buffer.add)(state.experience, *rows)
        learners, losses = train_learners(
            key, self._learner, state.learners, lambda k: self._draw(k, experience), self.config.updates
        )
        metrics = {name: loss.mean() for name, loss in losses.items()}
        metrics["transitions_held"] = jax.vmap(self._buffer.size)(experience).sum()
        return ActorLearningState(learners, experience), metrics

    def reserve(self, worlds: int) -> None:
        """Makes the buffers large enough for generations of so many worlds.

        Raises:
            UserError: that is more than what was asked for.
        """
        env = self._env
        capacity = capacity_for(most_transitions(env, worlds), self.config.buffer_capacity)
        self._buffer = ReplayBuffer(
            capacity // self._n_buffers, env.observation_size, env.action_size, len(env.skills)
        )

    def transient_bytes(self, worlds: int) -> int:
        """What so many worlds take until they are in the buffer, and a round of updates after that."""
        rows = most_transitions(self._env, worlds) // self._agents_per_row
        width = self._buffer.width
        learners = self.n_actors * self._agents_per_row
        return 3 * 4 * rows * width + round_bytes(self._learner.config, learners, width)

    def _draw(self, key: Key[Array, ""], experience: Any) -> Batch:
        """Each actor's mini-batches, with leading axes [actors, policy_delay, batch_size]."""
        learner = self._learner.config
        shape = (self.n_actors, learner.policy_delay, learner.batch_size)
        each = math.prod(shape) // self._n_buffers
        keys = jax.random.split(key, self._n_buffers)
        drawn = jax.vmap(lambda held, k: self._buffer.sample(held, k, each))(experience, keys)
        return self._batch(jax.tree.map(lambda leaf: leaf.reshape(*shape, *leaf.shape[2:]), drawn))

    def _batch(self, drawn: Transitions) -> Batch:
        discount = None
        if self._discounts:
            one_each = jnp.array(self._discounts)[:, None, None]
            discount = jnp.broadcast_to(one_each, drawn.terminated.shape)
        return Batch(
            observation=drawn.observation,
            action=drawn.action,
            reward=self._reward(drawn.local_rewards, drawn.team_reward),
            next_observation=drawn.next_observation,
            terminated=drawn.terminated * float(self.config.task_ends_value),
            discount=discount,
        )

    def _rows_of(self, trajectories: Trajectories) -> tuple[Transitions, Bool[Array, " items"]]:
        return transitions_of(trajectories)

    def _by_buffer(
        self, transitions: Transitions, mask: Bool[Array, " items"]
    ) -> tuple[Transitions, Bool[Array, "buffers own"]]:
        """Rows of all agents, each in the buffer where it belongs; agents vary fastest."""

        def split(leaf: Array) -> Array:
            shape = (len(leaf) // self._n_buffers, self._n_buffers, *leaf.shape[1:])
            return jnp.moveaxis(leaf.reshape(shape), 1, 0)

        return jax.tree.map(split, transitions), split(mask)
