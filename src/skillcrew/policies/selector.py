"""Policies over skills."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, Key

from skillcrew.policies.memory import MemoryNetwork, PolicyConfig


class Selector(eqx.Module):
    """From one agent's observation to the index of a skill (π, eq. 3.5): the highest score wins."""

    network: MemoryNetwork

    @classmethod
    def create(
        cls, key: Key[Array, ""], observation_size: int, n_skills: int, config: PolicyConfig
    ) -> "Selector":
        return cls(MemoryNetwork.create(key, observation_size, n_skills, config))

    def __call__(
        self, observation: Float[Array, " obs"], memory: Float[Array, " units"]
    ) -> tuple[Int[Array, ""], Float[Array, " units"]]:
        """The chosen skill, and the new memory."""
        scores, memory = self.network(observation, memory)
        return jnp.argmax(scores).astype(jnp.int32), memory
