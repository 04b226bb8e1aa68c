"""What all learners on fresh episodes are told."""

import dataclasses
from typing import ClassVar

from skillcrew.errors import UserError


@dataclasses.dataclass(frozen=True)
class OnPolicyLearnerConfig:
    """How policies and critics learn.

    Raises:
        UserError: a value that is out of range.
    """

    section: ClassVar[str] = "learner"
    """What messages call it."""

    discount: float = 0.99
    """Discount γ per step."""
    trace: float = 0.95
    """λ of advantages and returns: 0 trusts the critic after one step, 1 only whole returns."""
    epochs: int = 5
    """Times that a generation's episodes are learned from."""
    minibatches: int = 4
    """Parts that each epoch deals a generation's episodes out to; must divide their number."""
    learning_rate: float = 5e-4
    """Adam's step size, of policies and critics."""
    entropy: float = 0.01
    """Weight of the policies' entropy, which keeps them trying."""
    longest_gradient: float = 10.0
    """Gradients are cut to this length (Yu et al. 2022)."""
    normalise_values: bool = True
    """Whether critics learn returns on their running scale (Yu et al. 2022)."""

    def __post_init__(self) -> None:
        for field in ("discount", "trace"):
            if not 0 <= getattr(self, field) <= 1:
                raise UserError(self._said(field, "give a number from 0 to 1"))
        for field in ("epochs", "minibatches"):
            if getattr(self, field) < 1:
                raise UserError(self._said(field, "give at least 1"))
        for field in ("learning_rate", "longest_gradient"):
            if not getattr(self, field) > 0:
                raise UserError(self._said(field, "give a positive number"))
        if not self.entropy >= 0:
            raise UserError(self._said("entropy", "give a number of at least 0"))

    def check_episodes(self, episodes: int) -> None:
        """Raises `UserError` if a generation's episodes cannot be dealt out evenly."""
        if episodes % self.minibatches:
            raise UserError(
                self._said("minibatches", f"does not divide episodes = {episodes}; give a divisor of it")
            )

    def _said(self, field: str, how: str) -> str:
        return f"{self.section}.{field} = {getattr(self, field)}: {how}"
