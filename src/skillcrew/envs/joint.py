"""A team as one agent, which sees what all see and moves them all: how single-agent methods meet a team."""

from jaxtyping import Array, Float

from skillcrew.envs.environment import Environment
from skillcrew.envs.wrapper import Wrapper


class Joint(Wrapper):
    """The same world for a single actor that sees and moves everybody; its local rewards are summed up."""

    def __init__(self, env: Environment):
        super().__init__(env)
        self.n_agents = 1
        self.observation_size = env.n_agents * env.observation_size
        self.action_size = env.n_agents * env.action_size
        self.decisions = env.n_agents * env.decisions

    def transform_observation(
        self, observation: Float[Array, "agents obs *worlds"]
    ) -> Float[Array, "one joint *worlds"]:
        return join(observation)

    def transform_action(self, action: Array) -> Array:
        # Discrete actions are one for each agent already.
        return action if self.choices else part(action, self.env.n_agents)

    def transform_rewards(
        self, local_rewards: Float[Array, "agents skills *worlds"]
    ) -> Float[Array, "one skills *worlds"]:
        return local_rewards.sum(0, keepdims=True)


def join(of_agents: Float[Array, "agents size *worlds"]) -> Float[Array, "one joint *worlds"]:
    """All agents' numbers in a row, agent by agent."""
    return of_agents.reshape(1, -1, *of_agents.shape[2:])


def part(joint: Float[Array, "one joint *worlds"], n_agents: int) -> Float[Array, "agents size *worlds"]:
    """The inverse of `join`."""
    return joint.reshape(n_agents, -1, *joint.shape[2:])
