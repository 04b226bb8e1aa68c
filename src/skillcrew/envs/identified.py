"""Agents that are told which of them they are, so that one network can treat each differently."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from skillcrew.envs.environment import Environment
from skillcrew.envs.wrapper import Wrapper


class Identified(Wrapper):
    """The same world; each observation ends in a row of zeros with a one at the agent's own place."""

    def __init__(self, env: Environment):
        super().__init__(env)
        self.observation_size = env.observation_size + env.n_agents

    def transform_observation(
        self, observation: Float[Array, "agents obs *worlds"]
    ) -> Float[Array, "agents told *worlds"]:
        return identify(observation)


def identify(observation: Float[Array, "agents obs *worlds"]) -> Float[Array, "agents told *worlds"]:
    """Observations, each with its agent's identity behind it."""
    n_agents, _, *worlds = observation.shape
    identity = jnp.eye(n_agents).reshape(n_agents, n_agents, *(1 for _ in worlds))
    return jnp.concatenate([observation, jnp.broadcast_to(identity, (n_agents, n_agents, *worlds))], axis=1)
