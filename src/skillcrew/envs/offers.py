"""What an environment may offer beyond `reset` and `step`, each asked for by what it is."""

from collections.abc import Mapping
from typing import Any, Protocol, TypeVar, runtime_checkable

from jaxtyping import Array, Float, Key, PyTree

from skillcrew.envs.scene import Scene
from skillcrew.errors import UserError


@runtime_checkable
class OffersCentralState(Protocol):
    """The whole state as numbers, for critics that see more than an agent does."""

    def central_state(self, state: PyTree) -> Float[Array, " features"]:
        """Of one world."""
        ...


@runtime_checkable
class OffersCounterfactuals(Protocol):
    """What the team's reward would have been with more or fewer of each agent, for difference rewards."""

    def counterfactual_rewards(
        self, state: PyTree, action: Array, key: Key[Array, ""], copies: int
    ) -> Float[Array, " agents"]:
        """For each agent the team reward of this step if that agent were there so many times.

        Args:
            copies: 0 removes the agent, 1 is the step as it is, 3 adds two copies that do what it does.
        """
        ...


@runtime_checkable
class OffersScene(Protocol):
    """A picture."""

    def scene(self, state: PyTree) -> Scene:
        """Of one world at one moment."""
        ...


@runtime_checkable
class OffersSkillTexts(Protocol):
    """Words for what each skill does."""

    skill_texts: Mapping[str, str]
    """A sentence for each of `skills`, by name."""


Offer = TypeVar("Offer")

MEMBERS: Mapping[Any, str] = {
    OffersCentralState: "central_state(state)",
    OffersCounterfactuals: "counterfactual_rewards(state, action, key, copies)",
    OffersScene: "scene(state)",
    OffersSkillTexts: "skill_texts",
}
"""What an environment has to define for each offer."""


def offers(env: Any, offer: type[Offer]) -> bool:
    """Whether an environment, or the one inside its wrappers, has it."""
    return isinstance(unwrapped(env), offer)


def require(env: Any, offer: type[Offer], needed_by: str) -> Offer:
    """The environment inside its wrappers, as one that has it.

    Args:
        needed_by: what asks for it, for the message.

    Raises:
        UserError: it does not.
    """
    inner = unwrapped(env)
    if isinstance(inner, offer):
        return inner
    raise UserError(f"{needed_by} needs {MEMBERS[offer]}, which {env.name} does not offer; define it there")


def unwrapped(env: Any) -> Any:
    """The environment inside all wrappers."""
    while (inner := getattr(env, "env", None)) is not None:
        env = inner
    return env
