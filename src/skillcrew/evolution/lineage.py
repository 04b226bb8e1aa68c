"""Fitness averaged over a lineage, so that a lucky draw does not rule.

With ten episodes of a binary reward a mediocre individual looks perfect now and then, and among
forty individuals one of them almost always does. An individual's standing is therefore the mean
of all its evaluations, an elite's over its generations; a child can start with a share of its
parent's standing, as so many evaluations that it need not live through again.
"""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, Int


class Lineage(eqx.Module):
    """What is known of each individual before its next evaluation."""

    mean: Float[Array, " population"]
    """Mean fitness so far; means nothing where `evaluations` is 0."""
    evaluations: Float[Array, " population"]
    """Evaluations that the mean stands for; fractions come from inheritance."""

    @classmethod
    def create(cls, population: int) -> "Lineage":
        return cls(jnp.zeros(population), jnp.zeros(population))

    def add(
        self,
        fitness: Float[Array, " population"],
        memory: float,
        evaluations: Float[Array, " population"] | float = 1.0,
    ) -> "Lineage":
        """Takes in one evaluation of every individual.

        Args:
            memory: evaluations counted at most. What an individual was worth with the skills of
                long ago says little about it with today's.
            evaluations: how many this one counts for: more for who lived more episodes.
        """
        known = jnp.clip(self.evaluations, 0.0, jnp.maximum(memory - evaluations, 0.0))
        mean = (self.mean * known + fitness * evaluations) / (known + evaluations)
        return Lineage(mean, known + evaluations)

    def standing(self, prior: float, expected: Float[Array, ""]) -> Float[Array, " population"]:
        """What each individual is ranked by: its mean, drawn towards what is expected of anybody.

        One perfect evaluation says less than ten good ones. An individual counts as if it had also
        lived `prior` evaluations of the `expected` fitness, which is the population's; see `Level`.
        """
        return (self.mean * self.evaluations + expected * prior) / (self.evaluations + prior)

    def pick(
        self, parents: Int[Array, " children"], share: Float[Array, " children"] | float = 1.0
    ) -> "Lineage":
        """The standing that children take over from their parents, each with its share of the evaluations."""
        return Lineage(self.mean[parents], self.evaluations[parents] * share)

    def concatenate(self, *others: "Lineage") -> "Lineage":
        """One population after the other."""
        everyone = (self, *others)
        return Lineage(
            jnp.concatenate([one.mean for one in everyone]),
            jnp.concatenate([one.evaluations for one in everyone]),
        )


class Level(eqx.Module):
    """The population's mean fitness, averaged over generations."""

    mean: Float[Array, ""]
    generations: Float[Array, ""]
    """Those that it stands for."""

    @classmethod
    def create(cls) -> "Level":
        return cls(jnp.zeros(()), jnp.zeros(()))

    def add(self, lineage: Lineage, memory: float) -> "Level":
        """Takes in a generation, of which at most `memory` count."""
        known = jnp.minimum(self.generations, memory - 1)
        return Level((self.mean * known + lineage.mean.mean()) / (known + 1), known + 1)
