"""Teams of actors that live world by world, step by step and agent by agent, their networks in NumPy."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from oracles.generation import Episode
from oracles.recurrent import remember
from skillcrew.envs.environment import Environment


class ActorWorlds:
    """One environment, compiled once, and the episodes of teams in it."""

    def __init__(self, env: Environment):
        self.env = env
        self._reset, self._step = jax.jit(env.reset), jax.jit(env.step)

    def episode(self, actors: Any, start_key: Any) -> Episode:
        """One episode without noise.

        Args:
            actors: `MemoryNetwork`s with a leading axis, one for each agent or a single one.
            start_key: of the reset.
        """
        count = jax.tree.leaves(actors)[0].shape[0]
        own = [
            jax.tree.map(lambda leaf, index=agent % count: leaf[index], actors)
            for agent in range(self.env.n_agents)
        ]
        units = 0 if actors.unit is None else actors.unit.weight_hh.shape[-1]
        memories = [np.zeros(units)] * self.env.n_agents
        state, seen = jax.device_get(self._reset(start_key))
        rows, over = [], False
        while not over:
            outputs = [remember(own[a], seen[a], memories[a]) for a in range(self.env.n_agents)]
            action = np.tanh([output for output, _ in outputs]).astype(np.float32)
            memories = [memory for _, memory in outputs]
            state, step = jax.device_get(self._step(state, jnp.asarray(action), jax.random.key(0)))
            rows.append(
                (seen, action, step.observation, step.local_rewards, step.team_reward, step.terminated)
            )
            seen, over = step.observation, bool(step.terminated | step.truncated)
        return Episode(*(np.array(column) for column in zip(*rows, strict=True)))

    def episodes(self, teams: list[Any], start_keys: Any) -> list[list[Episode]]:
        """Every team's episode in every world."""
        return [[self.episode(team, key) for key in start_keys] for team in teams]


def discounted(episode: Episode, discount: float) -> float:
    """The team's return, by plain addition."""
    return sum(discount**time * float(reward) for time, reward in enumerate(episode.team_reward))


def steps_of(lived: list[list[Episode]]) -> int:
    """Environment steps in all."""
    return sum(len(episode) for team in lived for episode in team)
