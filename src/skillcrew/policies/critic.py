"""Action values Q(s, a)."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, Key

from skillcrew.envs.environment import ObservationScaling
from skillcrew.policies.network import MLP, NetworkConfig, scale_input


class Critic(eqx.Module):
    """From an observation and an action to the discounted return expected from there (Q_φ)."""

    network: MLP
    input_scaling: ObservationScaling = eqx.field(static=True)

    @classmethod
    def create(
        cls,
        key: Key[Array, ""],
        observation_size: int,
        action_size: int,
        config: NetworkConfig,
        values: int = 1,
    ) -> "Critic":
        """Draws a critic.

        Args:
            values: how many returns it expects at once, such as those of all agents.
        """
        sizes = (observation_size + action_size, *config.hidden, values)
        return cls(MLP.create(key, sizes), config.scaling)

    def __call__(self, observation: Float[Array, " obs"], action: Float[Array, " act"]) -> Float[Array, ""]:
        return self.values(observation, action)[0]

    def values(
        self, observation: Float[Array, " obs"], action: Float[Array, " act"]
    ) -> Float[Array, " values"]:
        """All of them."""
        inputs = jnp.concatenate([scale_input(observation, self.input_scaling), action])
        return self.network(inputs)
