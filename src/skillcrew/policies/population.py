"""Populations as genomes: one row of numbers per individual, and the way back to networks."""

from collections.abc import Callable
from typing import Any, TypeVar

import jax
import jax.numpy as jnp
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Float, Int, Key

Individual = TypeVar("Individual")


class GenomeCodec:
    """Turns individuals into genomes and back.

    An individual is any pytree of floats with a leading axis of networks, such as the selectors
    of a team. Its genes are ordered network by network, so that a single cut of the genome leaves
    most of them whole.

    Args:
        create: draws one network from a key.
        networks: how many an individual has.
        alike: how likely the agents of a random individual are all alike; see `groups`.
    """

    def __init__(self, create: Callable[[Key[Array, ""]], Individual], networks: int, alike: float = 0.0):
        self._alike = alike
        self._create = create
        self.networks = networks
        self._unravel, self.genes_per_network = _unravelling(create)
        self.n_genes = networks * self.genes_per_network

    def create(self, key: Key[Array, ""], population: int) -> Float[Array, "population genes"]:
        """Draws the genomes of a random population."""
        if self._alike:
            key, key_groups = jax.random.split(key)
        keys = jax.random.split(key, (population, self.networks))
        flat = jax.vmap(jax.vmap(lambda k: ravel_pytree(self._create(k))[0]))(keys)
        if self._alike:
            of_individual = jax.vmap(lambda k: groups(k, self.networks, self._alike))
            group = of_individual(jax.random.split(key_groups, population))
            flat = jnp.take_along_axis(flat, group[:, :, None], axis=1)
        return flat.reshape(population, self.n_genes)

    def encode(self, individual: Individual) -> Float[Array, " genes"]:
        """The genome of one individual; the inverse of `decode`."""
        return jax.vmap(lambda network: ravel_pytree(network)[0])(individual).reshape(-1)

    def decode(self, genome: Float[Array, " genes"]) -> Individual:
        """The individual of one genome: its leaves have a leading axis of networks."""
        return jax.vmap(self._unravel)(genome.reshape(self.networks, self.genes_per_network))


def _unravelling(create: Callable[[Key[Array, ""]], Any]) -> tuple[Callable[[Array], Any], int]:
    """The way from a network's genes to the network, and how many they are."""
    ways = []

    # Only traced: to make a network and lay it out is a dozen small programs.
    def lay_out() -> Float[Array, " genes"]:
        genes, way = ravel_pytree(create(jax.random.key(0)))
        ways.append(way)
        return genes

    size = jax.eval_shape(lay_out).size
    return ways[0], size


def groups(key: Key[Array, ""], members: int, alike: float) -> Int[Array, " members"]:
    """Deals the members of a team out to groups, as evenly as can be; returns the group of each.

    Args:
        alike: probability of a single group; of two if not, and so on up to a group for each member.
    """
    key_number, key_deal = jax.random.split(key)
    more = (1 - alike) ** jnp.arange(1.0, members)
    number = 1 + (jax.random.uniform(key_number) < more).sum(dtype=jnp.int32)
    return jax.random.permutation(key_deal, members) % number
