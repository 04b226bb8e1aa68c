"""What every way to search offers, so that an algorithm need not know which one it uses."""

from collections.abc import Callable
from typing import Any, Protocol, runtime_checkable

import equinox as eqx
from jaxtyping import Array, Bool, Float, Key

Genome = Float[Array, " genes"]
Genomes = Float[Array, "population genes"]
Draw = Callable[[Key[Array, ""], int], Genomes]
"""Draws so many random genomes."""


class Migrants(eqx.Module):
    """Individuals from elsewhere, such as a learner's, which have lived the evaluation too."""

    genomes: Float[Array, "migrants genes"]
    fitness: Float[Array, " migrants"]
    arrive: Bool[Array, ""]
    """Whether they come this time."""


@runtime_checkable
class Evolver(Protocol):
    """Ask and tell: `genomes(state)` are to be evaluated, `next_generation` is told their fitness."""

    def init(self, key: Key[Array, ""], population: int, draw: Draw | None = None) -> Any:
        """The state before the first generation.

        Args:
            draw: of the genomes that it begins with; by default random ones, as for a search that begins
                anew.
        """
        ...

    def genomes(self, state: Any) -> Genomes:
        """The population that is to be evaluated now."""
        ...

    def next_generation(
        self,
        key: Key[Array, ""],
        state: Any,
        fitness: Float[Array, " population"],
        evaluations: Float[Array, " population"],
    ) -> Any:
        """The state after an evaluation.

        Args:
            fitness: of the present population, in its order; larger is better.
            evaluations: how much of an evaluation each fitness rests on; 1 for one as long as everybody's.
        """
        ...

    def standing(self, state: Any, fitness: Float[Array, " population"]) -> Float[Array, " population"]:
        """How good each individual is thought to be, the fitness of this evaluation included."""
        ...

    def champion(self, state: Any) -> Genome:
        """The individual to report."""
        ...

    def champion_fitness(self, state: Any) -> Float[Array, ""]:
        """What is known of the champion's fitness."""
        ...


class Host(Evolver, Protocol):
    """An evolver with places that migrants can take."""

    def next_generation(
        self,
        key: Key[Array, ""],
        state: Any,
        fitness: Float[Array, " population"],
        evaluations: Float[Array, " population"],
        migrants: Migrants | None = None,
    ) -> Any:
        """The state after an evaluation; the migrants replace the worst before anybody breeds."""
        ...
