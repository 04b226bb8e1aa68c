"""A team seen as one agent, whose observation and action are all agents' in a row."""

from typing import Any

from jaxtyping import Array, Float, Key, PyTree

from skillcrew.envs.environment import Environment, TimeStep


class Joint(Environment):
    """The same world for a single actor that sees and moves everybody; its local rewards are summed up."""

    n_agents = 1

    def __init__(self, env: Environment):
        self.env = env
        self.name = env.name
        self.observation_size = env.n_agents * env.observation_size
        self.action_size = env.n_agents * env.action_size
        self.episode_length = env.episode_length
        self.skills = env.skills

    def reset(self, key: Key[Array, ""]) -> tuple[PyTree, Float[Array, "agents obs"]]:
        state, observation = self.env.reset(key)
        return state, join(observation)

    def step(
        self, state: PyTree, action: Float[Array, "agents act"], key: Key[Array, ""]
    ) -> tuple[PyTree, TimeStep]:
        state, step = self.env.step(state, part(action, self.env.n_agents), key)
        return state, _joined(step)

    def reset_worlds(self, keys: Key[Array, " worlds"]) -> tuple[PyTree, Float[Array, "agents obs worlds"]]:
        state, observation = self.env.reset_worlds(keys)
        return state, join(observation)

    def step_worlds(
        self, state: PyTree, action: Float[Array, "agents act worlds"], keys: Key[Array, " worlds"]
    ) -> tuple[PyTree, TimeStep]:
        state, step = self.env.step_worlds(state, part(action, self.env.n_agents), keys)
        return state, _joined(step)

    def describe(self) -> dict[str, Any]:
        return self.env.describe()


def join(of_agents: Float[Array, "agents size *worlds"]) -> Float[Array, "one joint *worlds"]:
    """All agents' numbers in a row, agent by agent."""
    return of_agents.reshape(1, -1, *of_agents.shape[2:])


def part(joint: Float[Array, "one joint *worlds"], n_agents: int) -> Float[Array, "agents size *worlds"]:
    """The inverse of `join`."""
    return joint.reshape(n_agents, -1, *joint.shape[2:])


def _joined(step: TimeStep) -> TimeStep:
    return TimeStep(
        observation=join(step.observation),
        local_rewards=step.local_rewards.sum(0, keepdims=True),
        team_reward=step.team_reward,
        terminated=step.terminated,
        truncated=step.truncated,
    )
