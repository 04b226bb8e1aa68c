"""Deterministic policies over continuous actions; a skill is one of them."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, Key

from skillcrew.envs.environment import ObservationScaling
from skillcrew.policies.heads import MultiHead
from skillcrew.policies.network import MLP, NetworkConfig, scale_input


class Actor(eqx.Module):
    """From one agent's observation to its primitive action in [-1, 1] (μ_θ, or Π_k for a skill)."""

    network: MLP | MultiHead
    input_scaling: ObservationScaling = eqx.field(static=True)

    @classmethod
    def create(
        cls,
        key: Key[Array, ""],
        observation_size: int,
        action_size: int,
        config: NetworkConfig,
        heads: int = 0,
    ) -> "Actor":
        """Draws an actor.

        Args:
            heads: agents with a last layer of their own, by the identity in their observation; 0 for none.
        """
        sizes = (observation_size, *config.hidden, action_size)
        network = MultiHead.create(key, sizes, heads) if heads else MLP.create(key, sizes)
        return cls(network, config.scaling)

    def __call__(self, observation: Float[Array, " obs"]) -> Float[Array, " act"]:
        return jnp.tanh(self.before_squashing(observation))

    def before_squashing(self, observation: Float[Array, " obs"]) -> Float[Array, " act"]:
        """The action before tanh, unbounded."""
        return self.network(scale_input(observation, self.input_scaling))
