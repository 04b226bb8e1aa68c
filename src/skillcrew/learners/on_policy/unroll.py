"""Networks along whole episodes."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from skillcrew.policies.memory import MemoryNetwork
from skillcrew.policies.network import scale_input


def unrolled(
    networks: MemoryNetwork, inputs: Float[Array, "time worlds agents inputs"]
) -> Float[Array, "time worlds agents outputs"]:
    """The outputs at every step of episodes that all begin at the first one.

    A network with memory remembers from there; one without meets all steps in one matrix product.

    Args:
        networks: leaves have a leading axis: one for each agent, or a single one that all share.
    """
    time, worlds, agents, _ = inputs.shape
    if jax.tree.leaves(networks)[0].shape[0] == 1:
        shared = jax.tree.map(lambda leaf: leaf[0], networks)
        outputs = _along(shared, inputs.reshape(time, worlds * agents, -1))
        return outputs.reshape(time, worlds, agents, -1)
    return jax.vmap(_along, in_axes=(0, 2), out_axes=2)(networks, inputs)


def _along(
    network: MemoryNetwork, inputs: Float[Array, "time batch inputs"]
) -> Float[Array, "time batch outputs"]:
    seen = scale_input(inputs, network.input_scaling)
    unit = network.unit
    if unit is not None:

        def one_step(memory: Array, now: Array) -> tuple[Array, Array]:
            memory = jax.vmap(unit)(now, memory)
            return memory, memory

        nothing = jnp.zeros((inputs.shape[1], unit.hidden_size), inputs.dtype)
        seen = jnp.concatenate([seen, jax.lax.scan(one_step, nothing, seen)[1]], axis=-1)
    # As the rows of one matrix: XLA is slower where a gradient sums over time and batch apart.
    outputs = jax.vmap(network.network)(seen.reshape(-1, seen.shape[-1]))
    return outputs.reshape(*seen.shape[:2], -1)
