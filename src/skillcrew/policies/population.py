"""Populations as genomes: one row of numbers per individual, and the way back to networks."""

from collections.abc import Callable
from typing import TypeVar

import jax
import jax.numpy as jnp
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Float, Key

Individual = TypeVar("Individual")


class GenomeCodec:
    """Turns individuals into genomes and back.

    An individual is any pytree of floats with a leading axis of networks, such as the selectors
    of a team. Its genes are ordered network by network, so that a single cut of the genome leaves
    most of them whole.

    Args:
        create: draws one network from a key.
        networks: how many an individual has.
        alike: share of the individuals that are drawn with the same network for each agent.
    """

    def __init__(self, create: Callable[[Key[Array, ""]], Individual], networks: int, alike: float = 0.0):
        self._alike = alike
        self._create = create
        self.networks = networks
        shapes = jax.eval_shape(create, jax.random.key(0))
        zeros = jax.tree.map(lambda leaf: jnp.zeros(leaf.shape, leaf.dtype), shapes)
        flat, self._unravel = ravel_pytree(zeros)
        self.genes_per_network = flat.size
        self.n_genes = networks * flat.size

    def create(self, key: Key[Array, ""], population: int) -> Float[Array, "population genes"]:
        """Draws the genomes of a random population."""
        keys = jax.random.split(key, (population, self.networks))
        flat = jax.vmap(jax.vmap(lambda k: ravel_pytree(self._create(k))[0]))(keys)
        if self._alike:
            is_alike = jnp.arange(population) < round(self._alike * population)
            flat = jnp.where(is_alike[:, None, None], flat[:, :1], flat)
        return flat.reshape(population, self.n_genes)

    def encode(self, individual: Individual) -> Float[Array, " genes"]:
        """The genome of one individual; the inverse of `decode`."""
        return jax.vmap(lambda network: ravel_pytree(network)[0])(individual).reshape(-1)

    def decode(self, genome: Float[Array, " genes"]) -> Individual:
        """The individual of one genome: its leaves have a leading axis of networks."""
        return jax.vmap(self._unravel)(genome.reshape(self.networks, self.genes_per_network))
