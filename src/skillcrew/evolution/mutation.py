"""Random changes of genomes."""

import dataclasses
from typing import Literal

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Key

from skillcrew.errors import UserError, unknown_name


@dataclasses.dataclass(frozen=True)
class MutationConfig:
    """How an individual changes when it mutates.

    "substructured" is that of sub-structured neuroevolution (Khadka et al. 2019, used by ERL,
    CERL and MERL): few weights change, mostly by a little noise relative to their size, and
    sometimes they are drawn anew. What it also has there, large noise relative to their size, is
    off: it lets weights grow until networks are deaf (docs/algorithms/ea.md). "gaussian" adds
    noise to every weight.
    """

    kind: Literal["substructured", "gaussian"] = "substructured"
    """Which of the two."""
    probability: float = 0.9
    """Probability that a child mutates at all (ERL)."""
    fraction: float = 0.5
    """Largest share of weights that change in a mutating child."""
    smallest_fraction: float = 0.005
    """Smallest share. Each child draws its own between the two, uniformly in its logarithm: small changes
    refine, large ones look further away. Set both alike for a constant share (ERL: 0.1)."""
    strength: float = 0.2
    """Standard deviation of ordinary noise, as a share of the weight's size (ERL: 0.1)."""
    large_probability: float = 0.0
    """Of the changed weights, the share with large noise (ERL: 0.05)."""
    large_strength: float = 10.0
    """Standard deviation of large noise, as a share of the weight's size (ERL)."""
    reset_probability: float = 0.1
    """Of the changed weights, the share that is drawn anew (ERL: 0.05)."""
    reset_deviation: float = 0.5
    """Standard deviation of weights drawn anew (ERL: 1)."""
    gaussian_deviation: float = 0.05
    """Standard deviation of plain Gaussian noise."""
    limit: float = 100.0
    """Largest size that a change can give a weight (CERL: 10,000,000)."""

    def __post_init__(self) -> None:
        if self.kind not in ("substructured", "gaussian"):
            raise unknown_name("mutation.kind", str(self.kind), ("substructured", "gaussian"))
        for field in ("probability", "fraction", "large_probability", "reset_probability"):
            if not 0 <= getattr(self, field) <= 1:
                raise UserError(f"mutation.{field} = {getattr(self, field)}: give a share between 0 and 1")
        if not 0 < self.smallest_fraction <= self.fraction:
            raise UserError(
                f"mutation.smallest_fraction = {self.smallest_fraction}: give a share above 0 and up to "
                f"mutation.fraction = {self.fraction}"
            )
        if self.large_probability + self.reset_probability > 1:
            raise UserError(
                f"mutation.large_probability = {self.large_probability} and mutation.reset_probability = "
                f"{self.reset_probability}: their sum is above 1; lower one of them"
            )
        for field in ("strength", "large_strength", "reset_deviation", "gaussian_deviation"):
            if not getattr(self, field) >= 0:
                raise UserError(f"mutation.{field} = {getattr(self, field)}: give a number of at least 0")
        if not self.limit > 0:
            raise UserError(f"mutation.limit = {self.limit}: give a positive number, or inf for no limit")


def mutate(
    key: Key[Array, ""], genomes: Float[Array, "children genes"], config: MutationConfig
) -> tuple[Float[Array, "children genes"], Bool[Array, " children"]]:
    """Mutates each child with `config.probability`; returns the children and which of them changed."""
    key_child, key_change = jax.random.split(key)
    mutates = jax.random.bernoulli(key_child, config.probability, (genomes.shape[0],))
    change = substructured if config.kind == "substructured" else gaussian
    return jnp.where(mutates[:, None], change(key_change, genomes, config), genomes), mutates


def substructured(
    key: Key[Array, ""], genomes: Float[Array, "children genes"], config: MutationConfig
) -> Float[Array, "children genes"]:
    """Changes a share of each child's weights, a share of its own; see `MutationConfig`."""
    key_kind, key_noise, key_share = jax.random.split(key, 3)
    spread = jax.random.uniform(key_share, (genomes.shape[0], 1))
    share = config.fraction * (config.smallest_fraction / config.fraction) ** spread
    # One uniform number per weight decides both whether and how it changes.
    draw = jax.random.uniform(key_kind, genomes.shape) / share
    noise = jax.random.normal(key_noise, genomes.shape)
    large = config.large_probability
    reset = config.large_probability + config.reset_probability
    strength = jnp.where(draw < large, config.large_strength, config.strength)
    changed = jnp.where(
        (draw >= large) & (draw < reset), config.reset_deviation * noise, genomes * (1 + strength * noise)
    )
    return jnp.where(draw < 1, jnp.clip(changed, -config.limit, config.limit), genomes)


def gaussian(
    key: Key[Array, ""], genomes: Float[Array, "children genes"], config: MutationConfig
) -> Float[Array, "children genes"]:
    """Adds normal noise to every weight."""
    changed = genomes + config.gaussian_deviation * jax.random.normal(key, genomes.shape)
    return jnp.clip(changed, -config.limit, config.limit)
