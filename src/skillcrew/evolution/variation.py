"""How children differ from their parents, whatever genomes stand for."""

from typing import Protocol, runtime_checkable

from jaxtyping import Array, Bool, Float, Key

from skillcrew.evolution.crossover import single_point
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
