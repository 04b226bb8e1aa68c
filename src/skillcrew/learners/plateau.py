"""When a skill has learned enough: its return has stopped improving."""

import dataclasses

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from skillcrew.errors import UserError


@dataclasses.dataclass(frozen=True)
class PlateauConfig:
    """Training of a skill stops for good when its return R_k improves no further (thesis, 3.2.3)."""

    enabled: bool = True
    """False trains every skill to the end of the run."""
    window: int = 10
    """Generations without improvement after which a skill stops. Selectors evolve for the skills as
    they are: while skills go on changing, a champion of 0.85 was seen to fall to 0.5."""
    earliest: int = 30
    """Generation before which no skill stops: a skill that has not begun to learn does not improve either."""
    latest: int | None = None
    """Generation at which every skill stops, whatever its return. Default: none. Training costs the same for
    as long as a single skill goes on, so this is what bounds it."""
    tolerance: float = 0.01
    """What counts as improvement, as a share of the best return's size."""
    smoothing: float = 0.8
    """R_k is measured on few episodes; this is the weight of its past in the running average."""

    def __post_init__(self) -> None:
        if self.window < 1:
            raise UserError(f"plateau.window = {self.window}: give at least 1 generation")
        if self.earliest < 0:
            raise UserError(f"plateau.earliest = {self.earliest}: give a generation, or 0 for no such bound")
        if self.latest is not None and self.latest < 1:
            raise UserError(f"plateau.latest = {self.latest}: give a generation of at least 1")
        if not self.tolerance >= 0:
            raise UserError(f"plateau.tolerance = {self.tolerance}: give a number of at least 0")
        if not 0 <= self.smoothing < 1:
            raise UserError(f"plateau.smoothing = {self.smoothing}: give a number from 0 to below 1")


class Plateau(eqx.Module):
    """How each skill has come along."""

    smoothed: Float[Array, " skills"]
    """Running average of the return; -inf before the first."""
    best: Float[Array, " skills"]
    """Highest running average so far."""
    waited: Int[Array, " skills"]
    """Generations since that last improved."""
    stopped_at: Int[Array, " skills"]
    """Generation at which training stopped, or -1 while it goes on."""

    @classmethod
    def create(cls, n_skills: int) -> "Plateau":
        return cls(
            jnp.full(n_skills, -jnp.inf, jnp.float32),
            jnp.full(n_skills, -jnp.inf, jnp.float32),
            jnp.zeros(n_skills, jnp.int32),
            jnp.full(n_skills, -1, jnp.int32),
        )

    @property
    def stopped(self) -> Bool[Array, " skills"]:
        """Which skills train no more. Stopping is for good."""
        return self.stopped_at >= 0

    def stop_all(self, generation: Int[Array, ""], when: Bool[Array, ""]) -> "Plateau":
        """Whatever still trains stops, where `when`."""
        stopped_at = jnp.where(when & ~self.stopped, generation, self.stopped_at)
        return Plateau(self.smoothed, self.best, self.waited, stopped_at)

    def observe(
        self, returns: Float[Array, " skills"], generation: Int[Array, ""], config: PlateauConfig
    ) -> "Plateau":
        """Takes in one generation's returns R_k."""
        first = self.smoothed == -jnp.inf
        smoothed = jnp.where(
            first, returns, config.smoothing * self.smoothed + (1 - config.smoothing) * returns
        )
        margin = jnp.where(first, 0.0, config.tolerance * jnp.abs(self.best))
        improved = smoothed > self.best + margin
        waited = jnp.where(improved, 0, self.waited + 1)
        due = (waited >= config.window) & (generation >= config.earliest)
        if config.latest is not None:
            due |= generation >= config.latest
        stops = due & ~self.stopped & config.enabled
        return Plateau(
            smoothed,
            jnp.where(improved, smoothed, self.best),
            waited,
            jnp.where(stops, generation, self.stopped_at),
        )


def mean_return(
    rewards: Float[Array, "time *any"], mask: Bool[Array, "time *any"], discount: float
) -> Float[Array, ""]:
    """R = Σ_n γ^n r(t + n) to the episode's end, averaged over all steps that count t (thesis, 3.2.3).

    The reward at step u counts γ^n for each earlier t = u - n, (1 - γ^(u+1)) / (1 - γ) in all.
    """
    steps = jnp.arange(1, rewards.shape[0] + 1, dtype=jnp.float32)
    weight = (1 - discount**steps) / (1 - discount)
    weight = weight.reshape(-1, *(1,) * (rewards.ndim - 1))
    return jnp.where(mask, rewards * weight, 0.0).sum() / mask.sum(dtype=jnp.float32)


def gone_on(
    rewards: Float[Array, "time worlds *any"],
    mask: Bool[Array, "time worlds"],
    terminated: Bool[Array, "time worlds"],
) -> tuple[Float[Array, "time worlds *any"], Bool[Array, "time worlds"]]:
    """Rewards, and the steps that count, as if done tasks ended no episode: each last reward goes on.

    A value that does not end with the team's task is compared with a return that does not either: else a
    skill that finishes the task is paid for a few steps, and one that waits just outside it for all of them.
    """
    done = (terminated & mask).any(0)
    last = jnp.maximum(mask.sum(0) - 1, 0)
    paid_last = jnp.take_along_axis(rewards, last.reshape(1, -1, *(1,) * (rewards.ndim - 2)), axis=0)
    lived = mask.reshape(*mask.shape, *(1,) * (rewards.ndim - 2))
    return jnp.where(lived, rewards, paid_last), mask | done[None]
