"""Networks that may remember, and teams that may share one: what evolution searches for."""

import dataclasses
from collections.abc import Callable
from typing import Any, Literal, Protocol, runtime_checkable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Key, PyTree

from skillcrew.envs.environment import Environment, ObservationScaling
from skillcrew.errors import UserError, unknown_name
from skillcrew.policies.action_values import ActionValues
from skillcrew.policies.actor import Actor
from skillcrew.policies.heads import MultiHead
from skillcrew.policies.network import MLP, MOST_UNITS, NetworkConfig, scale_input


@dataclasses.dataclass(frozen=True)
class PolicyConfig(NetworkConfig):
    """Size, input, memory and sharing of the networks that evolve."""

    hidden: tuple[int, ...] = (16,)
    """Units of each hidden layer (rectified linear); none for a linear map."""
    memory: int = 0
    """Units of a gated recurrent unit (GRU; Cho et al. 2014) that carries what was seen from step to step;
    0 is a feed-forward network, which knows the present observation alone."""
    sharing: Literal["agent", "team"] = "agent"
    """Whose a network is: "agent" gives each agent of a team its own (the thesis's), "team" one to all; where
    agents differ, one to all of a type."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0 <= self.memory <= MOST_UNITS:
            raise UserError(
                f"memory = {self.memory}: give a number of units up to {MOST_UNITS}, or 0 for no memory"
            )
        if self.sharing not in ("agent", "team"):
            raise unknown_name("sharing", str(self.sharing), ("agent", "team"))

    def networks(self, env: Environment) -> int:
        """How many networks a team has in an environment: of its agents, or of its types of agents."""
        return env.n_agents if self.sharing == "agent" else max(1, len(env.types))


class MemoryNetwork(eqx.Module):
    """A feed-forward network which, with memory, sees a recurrent unit's state beside the observation.

    Without memory it is its feed-forward part alone, and what it remembers is empty.
    """

    network: MLP | MultiHead
    unit: eqx.nn.GRUCell | None
    input_scaling: ObservationScaling = eqx.field(static=True)

    @classmethod
    def create(
        cls,
        key: Key[Array, ""],
        observation_size: int,
        outputs: int,
        config: PolicyConfig,
        remembered_size: int | None = None,
    ) -> "MemoryNetwork":
        """Draws a network; the recurrent unit's weights are uniform, as Equinox draws them.

        Args:
            remembered_size: length of what the recurrent unit sees, where that is something else.
        """
        sizes = (observation_size + config.memory, *config.hidden, outputs)
        if not config.memory:
            return cls(MLP.create(key, sizes), None, config.scaling)
        key_network, key_unit = jax.random.split(key)
        unit = eqx.nn.GRUCell(remembered_size or observation_size, config.memory, key=key_unit)
        return cls(MLP.create(key_network, sizes), unit, config.scaling)

    @classmethod
    def of_actor(cls, actor: Actor | ActionValues) -> "MemoryNetwork":
        """An actor as a network without memory; what makes an action of its outputs is left to the team."""
        network = actor.ranking if isinstance(actor, ActionValues) else actor.network
        return cls(network, None, actor.input_scaling)

    def silent(self) -> "MemoryNetwork":
        """The same, with outputs of 0 whatever it sees; only for one that ends in an `MLP`."""
        assert isinstance(self.network, MLP)
        return dataclasses.replace(self, network=self.network.silent())

    def initial_memory(self) -> Float[Array, " units"]:
        """What is remembered before the first step: nothing."""
        return jnp.zeros(self.unit.hidden_size if self.unit else 0)

    def __call__(
        self, observation: Float[Array, " obs"], memory: Float[Array, " units"]
    ) -> tuple[Float[Array, " outputs"], Float[Array, " units"]]:
        """The outputs, and the new memory."""
        seen = scale_input(observation, self.input_scaling)
        if self.unit:
            memory = self.unit(seen, memory)
            seen = jnp.concatenate([seen, memory])
        return self.network(seen), memory


@runtime_checkable
class Remembers(Protocol):
    """A network, or a selector, that carries something from step to step."""

    def initial_memory(self) -> Float[Array, " units"]:
        """What is remembered before the first step."""
        ...


def initial_memories(networks: Remembers, n_agents: int) -> Float[Array, "agents units"]:
    """Every agent's memory at the start of an episode.

    Args:
        networks: with a leading axis: one for each agent, or a single one that all share.
    """
    memories = jax.vmap(lambda network: network.initial_memory())(networks)
    return jnp.broadcast_to(memories, (n_agents, memories.shape[1]))


def dealt_out(networks: PyTree, types: tuple[int, ...], config: PolicyConfig) -> PyTree:
    """A team's networks, of each type of agents one, as one for each agent; any others as they are.

    Args:
        types: the index of each agent's type; empty where agents are alike.
    """
    if config.sharing == "agent" or not types:
        return networks
    return jax.tree.map(lambda leaf: leaf[np.array(types)], networks)


def collected(networks: PyTree, types: tuple[int, ...], config: PolicyConfig) -> PyTree:
    """The inverse of `dealt_out`."""
    if config.sharing == "agent" or not types:
        return networks
    first = np.array([types.index(one) for one in sorted(set(types))])
    return jax.tree.map(lambda leaf: leaf[first], networks)


def for_each_agent(function: Callable[..., Any], networks: PyTree, *inputs: Array) -> Any:
    """`function(network, *input)` of every agent.

    Args:
        networks: leaves have a leading axis: one network for each agent, or a single one that all share.
        inputs: with a leading agent axis.
    """
    count = jax.tree.leaves(networks)[0].shape[0]
    if count == 1:
        # Applied once to all agents: one large matrix product instead of as many as there are agents.
        shared = jax.tree.map(lambda leaf: leaf[0], networks)
        return jax.vmap(lambda *own: function(shared, *own))(*inputs)
    return jax.vmap(function)(networks, *inputs)
