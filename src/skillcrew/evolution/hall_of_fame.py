"""The best teams of earlier generations, kept to be teamed up with (Rosin and Belew; thesis, 2.1.9.1)."""

import dataclasses
from typing import Literal

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, Key

from skillcrew.errors import UserError, unknown_name


@dataclasses.dataclass(frozen=True)
class HallOfFameConfig:
    """How many are kept, and how often they play."""

    size: int = 0
    """Teams kept, one of each generation at most; 0 for no hall of fame."""
    share: float = 0.5
    """Probability that a place in a team is taken by a member of the hall instead of a living individual; not
    in the first team of each individual, in which only the living play."""
    sampling: Literal["uniform", "proportional"] = "uniform"
    """Which team of the hall a place is filled from: any, or one with probability proportional to its
    fitness, counted from the worst of the hall where that is below 0."""

    def __post_init__(self) -> None:
        if self.size < 0:
            raise UserError(
                f"hall_of_fame.size = {self.size}: give a number of teams, or 0 for no hall of fame"
            )
        if not 0 < self.share < 1:
            raise UserError(
                f"hall_of_fame.share = {self.share}: give a probability above 0 and below 1, for some places "
                "must be left to the living (no hall of fame: hall_of_fame.size = 0)"
            )
        if self.sampling not in ("uniform", "proportional"):
            raise unknown_name("hall_of_fame.sampling", str(self.sampling), ("uniform", "proportional"))


class HallOfFame(eqx.Module):
    """Teams of earlier generations; the places that are still free have fitness -inf."""

    genomes: Float[Array, "kept agents genes"]
    fitness: Float[Array, " kept"]
    """As measured when the team entered."""

    @classmethod
    def create(cls, size: int, n_agents: int, genes: int) -> "HallOfFame":
        return cls(jnp.zeros((size, n_agents, genes)), jnp.full(size, -jnp.inf))

    @property
    def taken(self) -> Bool[Array, " kept"]:
        """Which places hold a team."""
        return self.fitness > -jnp.inf

    def enter(self, team: Float[Array, "agents genes"], fitness: Float[Array, ""]) -> "HallOfFame":
        """A team takes a free place, or that of the worst if it is better."""
        worst = jnp.argmin(self.fitness)
        enters = fitness > self.fitness[worst]
        return HallOfFame(
            self.genomes.at[worst].set(jnp.where(enters, team, self.genomes[worst])),
            self.fitness.at[worst].max(fitness),
        )

    def draw(
        self, key: Key[Array, ""], shape: tuple[int, ...], config: HallOfFameConfig
    ) -> Int[Array, "*shape"]:
        """Teams to fill places from, drawn with replacement; means nothing while no place is taken."""
        weight = jnp.ones_like(self.fitness)
        if config.sampling == "proportional":
            known = jnp.where(self.taken, self.fitness, 0.0)
            # Where all are at 0, or all are equal below it, all are equally likely.
            weight = known - jnp.minimum(known.min(), 0.0) + jnp.finfo(jnp.float32).tiny
        chance = jnp.where(self.taken, weight, 0.0)
        chance = jnp.where(self.taken.any(), chance, 1.0)
        return jax.random.choice(key, config.size, shape, p=chance / chance.sum()).astype(jnp.int32)
