"""A deterministic toy environment, a team for it, and the same in plain NumPy loops.

Every world has its own length: worlds with a limit beyond their time limit are cut off (some of
them earlier than the longest episode), the others end by themselves. Whatever is stepped after its
end pays and shows absurd numbers, so that padding taken for experience cannot go unnoticed.
"""

import dataclasses
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from skillcrew.envs.environment import Environment, TimeStep

AGENTS, OBSERVATION, ACTION, SKILLS, LENGTH = 3, 5, 2, 4, 6
AFTER_THE_END = 1000.0
IMPATIENT, SHORT = 0.6, 3
"""Worlds whose first offset is above the one are cut off after the other many steps."""


class Toy(Environment):
    """Agents add up their actions."""

    name = "toy"
    n_agents, observation_size, action_size = AGENTS, OBSERVATION, ACTION
    episode_length = LENGTH
    skills = ("wait", "push", "pull", "turn")

    def reset(self, key):
        draw = jax.random.uniform(key, (AGENTS + 1,))
        state = {
            "sum": jnp.zeros((AGENTS, ACTION)),
            "offset": draw[:AGENTS],
            "limit": jnp.floor(2 + 7 * draw[AGENTS]).astype(jnp.int32),
            "time": jnp.zeros((), jnp.int32),
        }
        return state, self._observe(state)

    def step(self, state, action, key):
        del key
        after = {**state, "sum": state["sum"] + action, "time": state["time"] + 1}
        cut = jnp.where(state["offset"][0] > IMPATIENT, SHORT, LENGTH)
        over = (state["time"] >= state["limit"]) | (state["time"] >= cut)
        poison = jnp.where(over, AFTER_THE_END, 0.0)
        time = after["time"].astype(jnp.float32)
        terminated = after["time"] >= state["limit"]
        step = TimeStep(
            observation=self._observe(after) + poison,
            local_rewards=after["sum"][:, :1] * jnp.arange(1.0, SKILLS + 1)[None] + time + poison,
            team_reward=0.25 * time + after["sum"].sum() + poison,
            terminated=terminated,
            truncated=(after["time"] >= cut) & ~terminated,
        )
        return after, step

    def _observe(self, state):
        shared = jnp.stack([state["time"].astype(jnp.float32), state["limit"].astype(jnp.float32)])
        return jnp.concatenate(
            [state["offset"][:, None], state["sum"], jnp.broadcast_to(shared, (AGENTS, 2))], axis=1
        )


class ToyTeam(eqx.Module):
    """Acts by a matrix on the observation, weaker as its memory, a count of its steps, grows."""

    weights: Any

    @classmethod
    def create(cls, key) -> "ToyTeam":
        return cls(jax.random.normal(key, (OBSERVATION, ACTION)))

    def initial_memory(self):
        return jnp.zeros(())

    def act(self, observation, memory, key):
        del key
        action = jnp.tanh(observation @ self.weights) / (1 + memory)
        choice = (jnp.arange(AGENTS) + memory.astype(jnp.int32)) % SKILLS
        return action, memory + 1, choice.astype(jnp.int32)


@dataclasses.dataclass
class Step:
    """One lived step, as a Python loop sees it."""

    observation: np.ndarray
    action: np.ndarray
    next_observation: np.ndarray
    local_rewards: np.ndarray
    team_reward: float
    terminated: bool
    choice: list[int]


def live(weights: np.ndarray, offset: np.ndarray, limit: int) -> list[Step]:
    """One episode of a team in one world, without noise."""
    total = np.zeros((AGENTS, ACTION))
    steps = []

    def observe(time: int) -> np.ndarray:
        return np.array([[offset[a], *total[a], time, limit] for a in range(AGENTS)])

    cut = SHORT if offset[0] > IMPATIENT else LENGTH
    for time in range(min(limit, cut)):
        seen = observe(time)
        action = np.tanh(seen @ weights) / (1 + time)
        total = total + action
        local = [[total[a, 0] * (k + 1) + time + 1 for k in range(SKILLS)] for a in range(AGENTS)]
        steps.append(
            Step(
                observation=seen,
                action=action,
                next_observation=observe(time + 1),
                local_rewards=np.array(local),
                team_reward=0.25 * (time + 1) + total.sum(),
                terminated=time + 1 >= limit,
                choice=[(a + time) % SKILLS for a in range(AGENTS)],
            )
        )
    return steps
