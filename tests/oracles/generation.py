"""One generation of MADyS lived world by world, with plain loops over teams, episodes and agents."""

import dataclasses
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from skillcrew.envs.environment import Environment


@dataclasses.dataclass
class Episode:
    """The lived steps of one world; arrays have a leading time axis."""

    observation: np.ndarray
    action: np.ndarray
    next_observation: np.ndarray
    local_rewards: np.ndarray
    team_reward: np.ndarray
    terminated: np.ndarray

    def __len__(self) -> int:
        return len(self.team_reward)


class Lived:
    """All episodes of a generation without noise: `teams[m][e]`, and `probes[k][e]` of single skills."""

    def __init__(self, env: Environment, selectors: Any, skills: Any, start_keys: Any, probes: int):
        self.env = env
        self._episode = jax.jit(self._live)
        worlds = [jax.jit(env.reset)(key) for key in start_keys]
        self.worlds = [jax.device_get(state) for state, _ in worlds]
        n_skills = skills.network.biases[0].shape[0]
        teams = [jax.tree.map(lambda leaf, m=m: leaf[m], selectors) for m in range(_first(selectors))]
        free = jnp.int32(-1)
        self.teams = [[self._cut(team, skills, free, *world) for world in worlds] for team in teams]
        self.probes = [
            [self._cut(teams[0], skills, jnp.int32(k), *world) for world in worlds[:probes]]
            for k in range(n_skills)
        ]

    def in_buffer_order(self) -> list[tuple[Episode, int, int]]:
        """(episode, time, agent) of every lived transition: by time, then world, then agent."""
        episodes = [episode for group in self.teams + self.probes for episode in group]
        return [
            (episode, time, agent)
            for time in range(self.env.episode_length)
            for episode in episodes
            if time < len(episode)
            for agent in range(self.env.n_agents)
        ]

    def steps(self) -> int:
        return sum(len(episode) for group in self.teams + self.probes for episode in group)

    def _live(self, team, skills, forced, state, observation):
        def one_step(carry, _):
            state, observation = carry
            actions = []
            for agent in range(self.env.n_agents):
                selector = jax.tree.map(lambda leaf, agent=agent: leaf[agent], team)
                choice = jnp.where(forced < 0, selector(observation[agent], jnp.zeros(0))[0], forced)
                skill = jax.tree.map(lambda leaf, choice=choice: leaf[choice], skills)
                actions.append(skill(observation[agent]))
            action = jnp.stack(actions)
            state, step = self.env.step(state, action, jax.random.key(0))
            return (state, step.observation), (observation, action, step)

        return jax.lax.scan(one_step, (state, observation), length=self.env.episode_length)[1]

    def _cut(self, *inputs) -> Episode:
        observation, action, step = jax.device_get(self._episode(*inputs))
        over = step.terminated | step.truncated
        length = int(np.argmax(over)) + 1 if over.any() else len(over)
        fields = (
            observation,
            action,
            step.observation,
            step.local_rewards,
            step.team_reward,
            step.terminated,
        )
        return Episode(*(field[:length] for field in fields))


def _first(tree: Any) -> int:
    return jax.tree.leaves(tree)[0].shape[0]
