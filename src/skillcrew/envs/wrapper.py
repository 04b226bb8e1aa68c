"""The same world, seen or acted in another way."""

import abc
from typing import Any

from jaxtyping import Array, Float, Key, PyTree

from skillcrew.envs.environment import Environment, TimeStep, TimeStepByType


class Wrapper(Environment):
    """Passes everything on to another environment; says how observations, actions and rewards change.

    Each of the three must work for one world and for many, the world axis last.
    """

    def __init__(self, env: Environment):
        self.env = env
        self.name = env.name
        self.n_agents = env.n_agents
        self.observation_size = env.observation_size
        self.action_size = env.action_size
        self.episode_length = env.episode_length
        self.skills = env.skills
        self.actions = env.actions
        self.decisions = env.decisions
        self.success = env.success
        self.input_scaling = env.input_scaling

    @abc.abstractmethod
    def transform_observation(self, observation: Any) -> Float[Array, "agents obs *worlds"]:
        """What agents see of the inner world's observations."""

    def transform_action(self, action: Array) -> Any:
        """The inner world's actions."""
        return action

    def transform_rewards(self, local_rewards: Any) -> Float[Array, "agents skills *worlds"]:
        """The local rewards, of the inner world's."""
        return local_rewards

    def reset(self, key: Key[Array, ""]) -> tuple[PyTree, Float[Array, "agents obs"]]:
        state, observation = self.env.reset(key)
        return state, self.transform_observation(observation)

    def step(self, state: PyTree, action: Array, key: Key[Array, ""]) -> tuple[PyTree, TimeStep]:
        state, step = self.env.step(state, self.transform_action(action), key)
        return state, self._changed(step)

    def reset_worlds(self, keys: Key[Array, " worlds"]) -> tuple[PyTree, Float[Array, "agents obs worlds"]]:
        state, observation = self.env.reset_worlds(keys)
        return state, self.transform_observation(observation)

    def step_worlds(
        self, state: PyTree, action: Array, keys: Key[Array, " worlds"]
    ) -> tuple[PyTree, TimeStep]:
        state, step = self.env.step_worlds(state, self.transform_action(action), keys)
        return state, self._changed(step)

    def describe(self) -> dict[str, Any]:
        return self.env.describe()

    def _changed(self, step: TimeStep | TimeStepByType) -> TimeStep:
        return TimeStep(
            observation=self.transform_observation(step.observation),
            local_rewards=self.transform_rewards(step.local_rewards),
            team_reward=step.team_reward,
            terminated=step.terminated,
            truncated=step.truncated,
        )
