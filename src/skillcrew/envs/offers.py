"""What an environment may offer beyond `reset` and `step`, each asked for by what it is."""

from collections.abc import Mapping, Sequence
from typing import Any, Protocol, TypeVar, runtime_checkable

from jaxtyping import Array, Float, Int, Key, PyTree

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
    """What the team would get with more or fewer of an agent, for difference rewards."""

    def counterfactual(self, state: PyTree) -> PyTree:
        """What of a state depends on who is in the team; all of it, if anything may."""
        ...

    def counterfactual_step(
        self, state: PyTree, other: PyTree, action: Any, key: Key[Array, ""], copies: Int[Array, " agents"]
    ) -> tuple[PyTree, Float[Array, ""]]:
        """One step of another world, in which each agent is there so many times.

        Copies are where their agent is and do what it does. Nobody senses anything: what agents would
        do otherwise is not asked.

        Args:
            state: of the world as it is lived in, before the step.
            other: what differs in the other one; `counterfactual(state)` while nothing does yet.
            copies: 0: the agent is not there, whatever it does; 1: as it is; 3: with two more like it.

        Returns:
            What differs after the step, and what the other team is paid for it.
        """
        ...


@runtime_checkable
class OffersObservationNames(Protocol):
    """What each number of an observation is, so that skills find their inputs again in another task."""

    observation_names: Sequence[str] | Mapping[str, Sequence[str]]
    """A name for each number, in order, the same wherever it means the same; where agents differ, names for
    each type, by its name."""


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
    OffersCounterfactuals: "counterfactual(state) and counterfactual_step(state, other, action, key, copies)",
    OffersObservationNames: "observation_names",
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
    raise UserError(f"{needed_by} needs {MEMBERS[offer]}, which {env.name} does not offer; define that there")


def unwrapped(env: Any) -> Any:
    """The environment inside all wrappers."""
    while (inner := getattr(env, "env", None)) is not None:
        env = inner
    return env
