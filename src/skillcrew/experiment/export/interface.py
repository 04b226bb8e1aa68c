"""A team's act as a function from named arrays to named arrays: what every exported form offers."""

import dataclasses
import math
from collections.abc import Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, PyTree

from skillcrew.envs.environment import Environment

NEXT = "next/"
"""Before the name of what is remembered, that of what is remembered from then on."""


@dataclasses.dataclass(frozen=True)
class Port:
    """A named array that goes in or out."""

    name: str
    shape: tuple[int, ...]
    dtype: str

    @property
    def words(self) -> str:
        """Shape and type, as messages say them."""
        return f"{self.dtype}{list(self.shape)}"

    @property
    def struct(self) -> jax.ShapeDtypeStruct:
        return jax.ShapeDtypeStruct(self.shape, np.dtype(self.dtype))


@dataclasses.dataclass(frozen=True)
class Interface:
    """What goes into a team's act and what comes out, of one world."""

    observation: tuple[Port, ...]
    """One, or where agents differ one for each type, "observation/TYPE"."""
    memory: tuple[Port, ...]
    """What goes in and, after `NEXT`, comes out; none where a team remembers nothing."""
    outputs: tuple[Port, ...]
    """"action" and "choice", or where agents differ one of each for each type."""

    @classmethod
    def of(cls, team: Any, observation: PyTree) -> "Interface":
        """A team's, by the shapes of its observation.

        Raises:
            ValueError: what it remembers changes its shape.
        """
        memory = jax.eval_shape(lambda own: own.initial_memory(), team)
        key = jax.eval_shape(lambda: jax.random.key(0))
        action, later, choice = jax.eval_shape(
            lambda own, *seen: own.act(*seen), team, observation, memory, key
        )
        if [leaf.shape for leaf in jax.tree.leaves(later)] != [
            leaf.shape for leaf in jax.tree.leaves(memory)
        ]:
            raise ValueError("what it remembers changes its shape")
        return cls(
            _ports("observation", observation),
            tuple(port for port in _ports("memory", memory) if math.prod(port.shape)),
            (*_ports("action", action), *_ports("choice", choice)),
        )

    @property
    def all_ports(self) -> tuple[Port, ...]:
        return (*self.observation, *self.memory, *self.outputs)

    @property
    def results(self) -> tuple[Port, ...]:
        """All that comes out, in order."""
        return (*self.outputs, *(dataclasses.replace(port, name=NEXT + port.name) for port in self.memory))

    def observation_shapes(self) -> PyTree:
        """As `Team.act` takes them."""
        if [port.name for port in self.observation] == ["observation"]:
            return self.observation[0].struct
        return {port.name.partition("/")[2]: port.struct for port in self.observation}

    def play(self, team: Any, inputs: Sequence[Array], key: Array) -> list[Array]:
        """`act`, from arrays for `observation` and `memory` to arrays for `results`."""
        seen, remembered = inputs[: len(self.observation)], list(inputs[len(self.observation) :])
        observation = jax.tree.unflatten(jax.tree.structure(self.observation_shapes()), seen)
        like, structure = jax.tree.flatten(team.initial_memory())
        memory = [remembered.pop(0) if leaf.size else leaf for leaf in like]
        action, later, choice = team.act(observation, jax.tree.unflatten(structure, memory), key)
        kept = [leaf for leaf in jax.tree.leaves(later) if leaf.size]
        return [*jax.tree.leaves(action), *jax.tree.leaves(choice), *kept]


def observation_of(env: Environment) -> PyTree:
    """The shapes of an environment's observation."""
    if env.types:
        return {
            kind.name: jax.ShapeDtypeStruct((kind.agents, kind.observation_size), jnp.float32)
            for kind in env.types
        }
    return jax.ShapeDtypeStruct((env.n_agents, env.observation_size), jnp.float32)


def initial_memory(team: Any) -> list[np.ndarray]:
    """What a team remembers at the start of an episode, for `Interface.memory`."""
    return [np.asarray(leaf) for leaf in jax.tree.leaves(team.initial_memory()) if leaf.size]


def _ports(name: str, tree: PyTree) -> tuple[Port, ...]:
    leaves, _ = jax.tree.flatten_with_path(tree)
    places = [jax.tree_util.keystr(path, simple=True, separator="/") for path, _ in leaves]
    return tuple(
        Port(f"{name}/{place}" if place else name, tuple(leaf.shape), str(leaf.dtype))
        for place, (_, leaf) in zip(places, leaves, strict=True)
    )
