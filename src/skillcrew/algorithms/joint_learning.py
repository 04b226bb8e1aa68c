"""Actors that learn primitive actions by gradient, with critics that see the whole team."""

import dataclasses
from typing import Any, Literal

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Key

from skillcrew.algorithms.actor_learning import ActorLearning, ActorLearningState, LearningConfig
from skillcrew.envs.environment import Environment
from skillcrew.errors import UserError, unknown_name
from skillcrew.learners.batch import Batch
from skillcrew.learners.maddpg import MADDPGLearner, MADDPGLearnerConfig
from skillcrew.policies.ensemble import EnsembleTeam
from skillcrew.policies.memory import MemoryNetwork
from skillcrew.policies.team import NoisyTeam
from skillcrew.replay import (
    ReplayBuffer,
    Transitions,
    capacity_for,
    joint_transitions_of,
    most_transitions,
)
from skillcrew.rollout import Lineup, Start, Trajectories


@dataclasses.dataclass(frozen=True)
class JointLearningConfig(LearningConfig):
    """What a team learns from, and how."""

    critic_sharing: Literal["agent", "team"] = "agent"
    """Whose a critic is: "agent" gives each agent its own (Lowe et al. 2017), "team" one to all, with a value
    for each agent. All of them see what everybody sees and does."""
    ensemble: int = 1
    """Policies of each agent, one of which is drawn to act in each episode (Lowe et al. 2017: 3); the first
    ones are the champion."""
    updates: int = 10
    """Updates of the critics per generation; a multiple of learner.policy_delay. Lowe et al. have one for
    each 100 steps."""
    learner: MADDPGLearnerConfig = dataclasses.field(default_factory=MADDPGLearnerConfig)
    """How they learn."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.critic_sharing not in ("agent", "team"):
            raise unknown_name("critic_sharing", str(self.critic_sharing), ("agent", "team"))
        if self.ensemble < 1:
            raise UserError(f"ensemble = {self.ensemble}: give at least 1 policy")


class JointLearning(ActorLearning):
    """One learner for the whole team, and a buffer in which a row is a step of all agents.

    Args:
        n_actors: one for each agent, or a single one that all share.

    Raises:
        UserError: a reward that the environment lacks.
    """

    def __init__(self, env: Environment, config: Any, n_actors: int):
        self._own_actors, self._agents_per_row = n_actors, env.n_agents
        super().__init__(env, config)

    def explorers(self, key: Key[Array, ""], state: ActorLearningState, start: Start) -> Lineup:
        """In each world a policy of each agent, drawn anew, with noise."""
        actors, config, choices = self._learned(state).actor, self.config, self._env.choices

        def explorer(acting: Array) -> NoisyTeam:
            return NoisyTeam(EnsembleTeam(actors, acting, choices), config.exploration_noise, choices)

        shape = (start.worlds, self._env.n_agents)
        return Lineup.of_pairs(explorer, jax.random.randint(key, shape, 0, config.ensemble), start)

    def actors(self, state: ActorLearningState) -> MemoryNetwork:
        """The first policy of each agent, or of the one that all share."""
        first = jax.tree.map(lambda leaf: leaf[:, 0], self._learned(state).actor)
        return jax.vmap(MemoryNetwork.of_actor)(first)

    def reserve(self, worlds: int) -> None:
        env, agents = self._env, self._env.n_agents
        capacity = capacity_for(most_transitions(env, worlds), self.config.buffer_capacity)
        self._buffer = ReplayBuffer(
            capacity // agents,
            agents * env.observation_size,
            agents * (env.action_size + 1),
            agents * len(env.skills),
        )

    def _make_learner(self, heads: int) -> MADDPGLearner:
        config, env = self.config, self._env
        return MADDPGLearner(
            config.learner,
            env.n_agents,
            env.observation_size,
            env.action_size,
            env.choices,
            actors=self._own_actors,
            whose=env.n_agents if config.critic_sharing == "agent" else 1,
            policies=config.ensemble,
        )

    def _rows_of(self, trajectories: Trajectories) -> tuple[Transitions, Bool[Array, " items"]]:
        return joint_transitions_of(trajectories)

    def _batch(self, drawn: Transitions) -> Batch:
        agents = self._env.n_agents

        def parted(joint: Array) -> Array:
            return joint.reshape(*joint.shape[:-1], agents, joint.shape[-1] // agents)

        def everybody_s(of_team: Array) -> Array:
            return jnp.broadcast_to(of_team[..., None], (*of_team.shape, agents))

        action, acted = jnp.split(drawn.action, [agents * self._env.action_size], axis=-1)
        return Batch(
            observation=parted(drawn.observation),
            action=parted(action),
            reward=self._reward(parted(drawn.local_rewards), everybody_s(drawn.team_reward)),
            next_observation=parted(drawn.next_observation),
            terminated=everybody_s(drawn.terminated * float(self.config.task_ends_value)),
            acted=acted.astype(jnp.int32),
        )

    def _learned(self, state: ActorLearningState) -> Any:
        """What the only learner knows."""
        return jax.tree.map(lambda leaf: leaf[0], state.learners)
