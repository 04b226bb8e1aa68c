"""Policies over skills: what evolution searches for."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, Key

from skillcrew.policies.network import MLP, InputScaling, NetworkConfig, scale_input


class Selector(eqx.Module):
    """From one agent's observation to the index of a skill (π, eq. 3.5): the highest score wins."""

    network: MLP
    input_scaling: InputScaling = eqx.field(static=True)

    @classmethod
    def create(
        cls, key: Key[Array, ""], observation_size: int, n_skills: int, config: NetworkConfig
    ) -> "Selector":
        sizes = (observation_size, *config.hidden, n_skills)
        return cls(MLP.create(key, sizes), config.input_scaling)

    def __call__(self, observation: Float[Array, " obs"]) -> Int[Array, ""]:
        scores = self.network(scale_input(observation, self.input_scaling))
        return jnp.argmax(scores).astype(jnp.int32)
