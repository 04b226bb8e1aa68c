"""Networks along whole episodes."""

import functools

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from skillcrew.policies.memory import MemoryNetwork
from skillcrew.policies.network import scale_input


def unrolled(
    networks: MemoryNetwork,
    inputs: Float[Array, "time worlds agents inputs"],
    by_all: Float[Array, "time worlds joint"] | None = None,
) -> Float[Array, "time worlds agents outputs"]:
    """The outputs at every step of episodes that all begin at the first one.

    A network with memory remembers from there; one without meets all steps in one matrix product.

    Args:
        networks: leaves have a leading axis: one for each agent, or a single one that all share.
        by_all: what networks, one for each agent, remember instead of their inputs: what all agents see.
    """
    time, worlds, agents, _ = inputs.shape
    if by_all is None and jax.tree.leaves(networks)[0].shape[0] == 1:
        shared = jax.tree.map(lambda leaf: leaf[0], networks)
        outputs = _along(shared, inputs.reshape(time, worlds * agents, -1), None)
        return outputs.reshape(time, worlds, agents, -1)
    return jax.vmap(_along, in_axes=(0, 2, None), out_axes=2)(networks, inputs, by_all)


def memories(
    network: MemoryNetwork, inputs: Float[Array, "time batch inputs"]
) -> Float[Array, "time batch units"]:
    """What a network remembers after each step of what it sees; only of one with memory."""
    assert network.unit is not None
    return _memories(network.unit, scale_input(inputs, network.input_scaling))


def _along(
    network: MemoryNetwork,
    inputs: Float[Array, "time batch inputs"],
    by_all: Float[Array, "time batch joint"] | None,
) -> Float[Array, "time batch outputs"]:
    seen = scale_input(inputs, network.input_scaling)
    if network.unit is not None:
        remembered = memories(network, inputs if by_all is None else by_all)
        seen = jnp.concatenate([seen, remembered], axis=-1)
    # As the rows of one matrix: XLA is slower where a gradient sums over time and batch apart.
    outputs = jax.vmap(network.network)(seen.reshape(-1, seen.shape[-1]))
    return outputs.reshape(*seen.shape[:2], -1)


def _memories(
    unit: eqx.nn.GRUCell, seen: Float[Array, "time batch inputs"]
) -> Float[Array, "time batch units"]:
    """What the unit remembers after each step.

    For the gradient a step is done again, not kept: to keep its gates takes longer, twice as long where the
    batch is large.
    """

    @functools.partial(jax.checkpoint, prevent_cse=False)
    def one_step(memory: Array, now: Array) -> tuple[Array, Array]:
        memory = _remembered(unit, memory, now)
        return memory, memory

    nothing = jnp.zeros((unit.hidden_size, seen.shape[1]), seen.dtype)
    return jax.lax.scan(one_step, nothing, seen.swapaxes(1, 2))[1].swapaxes(1, 2)


def _remembered(
    unit: eqx.nn.GRUCell, memory: Float[Array, "units batch"], seen: Float[Array, "inputs batch"]
) -> Float[Array, "units batch"]:
    """The unit's equations for a batch in columns, where nothing has to be transposed for its products."""
    assert unit.bias is not None and unit.bias_n is not None
    of_seen = jnp.split(unit.weight_ih @ seen + unit.bias[:, None], 3)
    of_memory = jnp.split(unit.weight_hh @ memory, 3)
    reset = jax.nn.sigmoid(of_seen[0] + of_memory[0])
    keep = jax.nn.sigmoid(of_seen[1] + of_memory[1])
    new = jnp.tanh(of_seen[2] + reset * (of_memory[2] + unit.bias_n[:, None]))
    return new + keep * (memory - new)
