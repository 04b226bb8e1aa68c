"""One network for several agents that differ in their last layer only (MERL; Khadka et al. 2019)."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, Key

from skillcrew.policies.network import MLP


class MultiHead(eqx.Module):
    """A trunk that all agents share and a linear head for each; inputs end in the agent's identity.

    The identity is the row that `envs.identified` appends: positive at the agent's own place, else 0.
    """

    network: MLP
    """The trunk, and the heads side by side as its last layer."""
    heads: int = eqx.field(static=True)

    @classmethod
    def create(cls, key: Key[Array, ""], sizes: tuple[int, ...], heads: int) -> "MultiHead":
        """Draws a network with `sizes` = (inputs with the identity, hidden…, outputs of one head)."""
        inputs, *hidden, outputs = sizes
        return cls(MLP.create(key, (inputs - heads, *hidden, heads * outputs)), heads)

    def __call__(self, x: Float[Array, " inputs"]) -> Float[Array, " outputs"]:
        """The outputs of the head that the identity points to."""
        own = jnp.where(x[-self.heads :] > 0, 1.0, 0.0)
        return own @ self.network(x[: -self.heads]).reshape(self.heads, -1)
