"""Values of discrete actions, and the policy that takes the best one; a skill over them is one of these."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, Key

from skillcrew.envs.environment import ObservationScaling
from skillcrew.policies.heads import MultiHead
from skillcrew.policies.network import MLP, NetworkConfig, scale_input


class ActionValues(eqx.Module):
    """From one agent's observation to the value of each of its actions (Q of a DQN)."""

    network: MLP | MultiHead
    """Outputs: advantages of all actions; behind them the state's value, if it has one of its own."""
    input_scaling: ObservationScaling = eqx.field(static=True)
    action_size: int = eqx.field(static=True)

    @classmethod
    def create(
        cls,
        key: Key[Array, ""],
        observation_size: int,
        action_size: int,
        config: NetworkConfig,
        heads: int = 0,
        dueling: bool = False,
    ) -> "ActionValues":
        """Draws a network.

        Args:
            heads: agents with a last layer of their own, by the identity in their observation; 0 for none.
            dueling: whether the state has a value of its own (Wang et al. 2016).
        """
        sizes = (observation_size, *config.hidden, action_size + dueling)
        network = MultiHead.create(key, sizes, heads) if heads else MLP.create(key, sizes)
        return cls(network, config.scaling, action_size)

    def __call__(self, observation: Float[Array, " obs"]) -> Float[Array, " act"]:
        outputs = self.network(scale_input(observation, self.input_scaling))
        advantages, value = outputs[: self.action_size], outputs[self.action_size :]
        return advantages - advantages.mean() + value[0] if len(value) else outputs

    @property
    def ranking(self) -> MLP | MultiHead:
        """The network without the state's value, which does not tell actions apart."""
        *weights, last_weight = self._layers.weights
        *biases, last_bias = self._layers.biases
        outputs = MLP((*weights, self._advantages(last_weight)), (*biases, self._advantages(last_bias)))
        return MultiHead(outputs, self.network.heads) if isinstance(self.network, MultiHead) else outputs

    @property
    def _layers(self) -> MLP:
        return self.network.network if isinstance(self.network, MultiHead) else self.network

    def _advantages(self, outputs: Float[Array, "*inputs outputs"]) -> Float[Array, "*inputs advantages"]:
        heads = self.network.heads if isinstance(self.network, MultiHead) else 1
        by_head = outputs.reshape(*outputs.shape[:-1], heads, -1)[..., : self.action_size]
        return by_head.reshape(*outputs.shape[:-1], heads * self.action_size)


def best_action(values: Float[Array, "agents act"], choices: int) -> Int[Array, " decisions"]:
    """The index of the highest value; of several, the first.

    Args:
        choices: how many values a decision is made among; an agent's values may be of several decisions.
    """
    return jnp.argmax(values.reshape(-1, choices), axis=-1).astype(jnp.int32)
