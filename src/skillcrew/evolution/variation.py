"""How children differ from their parents, whatever genomes stand for."""

from typing import Protocol, runtime_checkable

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Key

from skillcrew.evolution.crossover import single_point
from skillcrew.evolution.evolver import Draw
from skillcrew.evolution.mutation import MutationConfig, mutate


@runtime_checkable
class Variation(Protocol):
    """Recombines and changes genomes."""

    def crossover(
        self,
        key: Key[Array, ""],
        first: Float[Array, "children genes"],
        second: Float[Array, "children genes"],
    ) -> Float[Array, "children genes"]:
        """A child of each pair of parents."""
        ...

    def mutate(
        self, key: Key[Array, ""], genomes: Float[Array, "children genes"], judged: Bool[Array, ""]
    ) -> tuple[Float[Array, "children genes"], Bool[Array, " children"]]:
        """The children, and which of them changed.

        Args:
            judged: whether anybody was better than another. Where nobody is, nothing is selected.
        """
        ...


def around(founder: Float[Array, " genes"], variation: Variation) -> Draw:
    """Draws a population of the founder itself and mutants of it."""

    def draw(key: Key[Array, ""], population: int) -> Float[Array, "population genes"]:
        copies = jnp.broadcast_to(founder, (population, founder.shape[0]))
        mutants, _ = variation.mutate(key, copies, jnp.ones((), bool))
        return mutants.at[0].set(founder)

    return draw


class WeightVariation:
    """Varies genomes that are networks' weights and nothing else."""

    def __init__(self, config: MutationConfig):
        self.config = config

    def crossover(
        self,
        key: Key[Array, ""],
        first: Float[Array, "children genes"],
        second: Float[Array, "children genes"],
    ) -> Float[Array, "children genes"]:
        return single_point(key, first, second)

    def mutate(
        self, key: Key[Array, ""], genomes: Float[Array, "children genes"], judged: Bool[Array, ""]
    ) -> tuple[Float[Array, "children genes"], Bool[Array, " children"]]:
        del judged
        return mutate(key, genomes, self.config)
