"""What every learner on fresh episodes offers."""

from typing import Any, Protocol, runtime_checkable

from jaxtyping import Array, Float, Key

from skillcrew.learners.on_policy.config import OnPolicyLearnerConfig
from skillcrew.learners.on_policy.experience import Experience


@runtime_checkable
class OnPolicyLearner(Protocol):
    """`init(key) -> state`, `update(state, experience, key) -> (state, metrics)`; both pure."""

    @property
    def config(self) -> OnPolicyLearnerConfig:
        """How it learns."""
        ...

    def init(self, key: Key[Array, ""]) -> Any:
        """A learner that knows nothing; its `policies` have a leading axis of networks."""
        ...

    def update(self, state: Any, experience: Experience, key: Key[Array, ""]) -> tuple[Any, dict[str, Array]]:
        """Learns from a generation's episodes."""
        ...

    def floor(self, state: Any) -> Float[Array, ""]:
        """Share of the choices that are drawn evenly among all, to explore."""
        ...
