"""Populations as genomes: one row of numbers per individual, and the way back to networks."""

from collections.abc import Callable
from typing import TypeVar

import jax
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Float, Key

Individual = TypeVar("Individual")


class GenomeCodec:
    """Turns individuals into genomes and back.

    An individual is any pytree of floats, such as the selectors of a team with a leading agent
    axis. Its genes are ordered agent by agent, so that a single cut of the genome leaves most
    agents whole.

    Args:
        create: draws one agent's network from a key.
        n_agents: networks in an individual.
    """

    def __init__(self, create: Callable[[Key[Array, ""]], Individual], n_agents: int):
        self._create = create
        self.n_agents = n_agents
        shapes = jax.eval_shape(create, jax.random.key(0))
        zeros = jax.tree.map(lambda leaf: jax.numpy.zeros(leaf.shape, leaf.dtype), shapes)
        flat, self._unravel = ravel_pytree(zeros)
        self.genes_per_agent = flat.size
        self.n_genes = n_agents * flat.size

    def create(self, key: Key[Array, ""], population: int) -> Float[Array, "population genes"]:
        """Draws the genomes of a random population."""
        keys = jax.random.split(key, (population, self.n_agents))
        flat = jax.vmap(jax.vmap(lambda k: ravel_pytree(self._create(k))[0]))(keys)
        return flat.reshape(population, self.n_genes)

    def decode(self, genome: Float[Array, " genes"]) -> Individual:
        """The individual of one genome: its leaves have a leading agent axis."""
        return jax.vmap(self._unravel)(genome.reshape(self.n_agents, self.genes_per_agent))
