"""The shared replay buffer: every agent's transitions from every team, for every skill learner.

Storage and sampling are flashbax's. A transition is kept as one row of numbers, because reading
random rows is what a learner waits for, and one row is one or two cache lines where separate
fields would be six. Adding differs from flashbax's in one way: rows that were never lived are
left out, in place and without compacting them first.
"""

import dataclasses
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from flashbax.buffers import trajectory_buffer as flashbax
from jaxtyping import Array, Bool, Float, Int, Key

from skillcrew.envs.environment import Environment
from skillcrew.errors import UserError
from skillcrew.rollout import Trajectories


class Transitions(eqx.Module):
    """⟨s, a, s', r, g, terminated⟩ of single agents (thesis, section 3.2.2)."""

    observation: Float[Array, "*batch obs"]
    action: Float[Array, "*batch act"]
    next_observation: Float[Array, "*batch obs"]
    local_rewards: Float[Array, "*batch skills"]
    team_reward: Float[Array, "*batch"]
    terminated: Float[Array, "*batch"]
    """1 where the task was done: nothing to bootstrap. A time limit leaves 0."""


class ReplayBuffer:
    """A cyclic buffer of `capacity` transitions: once full, the oldest are overwritten."""

    def __init__(self, capacity: int, observation_size: int, action_size: int, n_skills: int):
        self.capacity = capacity
        self._sizes = (observation_size, action_size, observation_size, n_skills, 1, 1)

    @property
    def width(self) -> int:
        """Numbers per transition."""
        return sum(self._sizes)

    def init(self) -> Any:
        """An empty buffer, a flashbax `TrajectoryBufferState`."""
        empty = flashbax.init(jnp.zeros(self.width), add_batch_size=1, max_length_time_axis=self.capacity)
        # Of a definite type, or a restored run would be another program than the uninterrupted one.
        return dataclasses.replace(empty, current_index=jnp.zeros((), jnp.int32))

    def size(self, state: Any) -> Int[Array, ""]:
        """Transitions held."""
        return jnp.where(state.is_full, self.capacity, state.current_index)

    def add(self, state: Any, transitions: Transitions, mask: Bool[Array, " items"]) -> Any:
        """Adds the transitions that were lived, in order, and leaves out the padding.

        Args:
            transitions: with one leading axis of at most `capacity` items.
            mask: False for padding.
        """
        rows = self._pack(transitions)
        if rows.shape[0] > self.capacity:
            raise ValueError(f"{rows.shape[0]} transitions do not fit a buffer of {self.capacity}")
        end = state.current_index + jnp.cumsum(mask, dtype=jnp.int32)
        # Padding is sent beyond the end of the buffer, where the scatter drops it.
        place = jnp.where(mask, (end - 1) % self.capacity, self.capacity)
        experience = state.experience.at[0, place].set(rows, mode="drop")
        return dataclasses.replace(
            state,
            experience=experience,
            current_index=end[-1] % self.capacity,
            is_full=state.is_full | (end[-1] >= self.capacity),
        )

    def sample(self, state: Any, key: Key[Array, ""], batch: int) -> Transitions:
        """Draws `batch` transitions uniformly, with replacement. The buffer must not be empty."""
        rows = flashbax.sample(state, key, batch, sequence_length=1, period=1).experience
        return self._unpack(rows[:, 0])

    def sample_of(
        self,
        state: Any,
        key: Key[Array, ""],
        batch: int,
        members: Int[Array, "2"],
        n_agents: int,
    ) -> Transitions:
        """Draws transitions of some of the agents only.

        Agents live in step, so that a row's place says whose it is as long as `capacity` is a multiple of
        `n_agents`.

        Args:
            members: the first of those agents, and how many they are.
        """
        key_step, key_agent = jax.random.split(key)
        step = jax.random.randint(key_step, (batch,), 0, self.size(state) // n_agents)
        agent = jax.random.randint(key_agent, (batch,), members[0], members[0] + members[1])
        return self._unpack(state.experience[0, step * n_agents + agent])

    def _pack(self, transitions: Transitions) -> Float[Array, "items width"]:
        fields = (
            transitions.observation,
            transitions.action,
            transitions.next_observation,
            transitions.local_rewards,
            transitions.team_reward[:, None],
            transitions.terminated[:, None],
        )
        return jnp.concatenate(fields, axis=1)

    def _unpack(self, rows: Float[Array, "batch width"]) -> Transitions:
        ends = [sum(self._sizes[: field + 1]) for field in range(len(self._sizes) - 1)]
        *wide, team_reward, terminated = jnp.split(rows, ends, axis=1)
        return Transitions(*wide, team_reward[:, 0], terminated[:, 0])


USUAL_CAPACITY = 300_000
"""Transitions that a buffer holds unless a generation asks for more."""


def most_transitions(env: Environment, worlds: int) -> int:
    """Transitions that so many worlds of an environment give at most."""
    return worlds * env.episode_length * env.n_agents


def capacity_for(transitions: int, asked: int | None) -> int:
    """How many transitions to hold.

    Args:
        transitions: of one generation.
        asked: as many as this; None for `USUAL_CAPACITY`, or two generations where they are more.

    Raises:
        UserError: a generation does not fit.
    """
    if asked is None:
        return max(USUAL_CAPACITY, 2 * transitions)
    if transitions > asked:
        raise UserError(
            f"buffer_capacity = {asked}: smaller than the {transitions} transitions of one generation; "
            "raise it"
        )
    return asked


def transitions_of(trajectories: Trajectories) -> tuple[Transitions, Bool[Array, " items"]]:
    """Every agent's transitions in one row each, and which of them count."""
    time, worlds, agents = trajectories.choice.shape

    def per_agent(of_world: Array) -> Array:
        return jnp.broadcast_to(of_world[:, :, None], (time, worlds, agents)).reshape(-1)

    def flat(of_agent: Array) -> Array:
        return of_agent.reshape(time * worlds * agents, of_agent.shape[-1])

    transitions = Transitions(
        observation=flat(trajectories.observation),
        action=flat(trajectories.action),
        next_observation=flat(trajectories.next_observation),
        local_rewards=flat(trajectories.local_rewards),
        team_reward=per_agent(trajectories.team_reward),
        terminated=per_agent(trajectories.terminated).astype(jnp.float32),
    )
    return transitions, per_agent(trajectories.mask)


def joint_transitions_of(trajectories: Trajectories) -> tuple[Transitions, Bool[Array, " items"]]:
    """The whole team's transitions in one row for each step, agent by agent, and which of them count.

    Behind the actions stands each agent's choice.
    """
    items = trajectories.mask.size

    def joined(of_agents: Array) -> Array:
        return of_agents.reshape(items, -1)

    choice = joined(trajectories.choice).astype(jnp.float32)
    transitions = Transitions(
        observation=joined(trajectories.observation),
        action=jnp.concatenate([joined(trajectories.action), choice], axis=1),
        next_observation=joined(trajectories.next_observation),
        local_rewards=joined(trajectories.local_rewards),
        team_reward=trajectories.team_reward.reshape(items),
        terminated=trajectories.terminated.reshape(items).astype(jnp.float32),
    )
    return transitions, trajectories.mask.reshape(items)
