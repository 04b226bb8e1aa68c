"""What an environment offers beyond `reset` and `step`, where it does."""

from collections.abc import Callable, Iterator
from typing import Any

import jax

from skillcrew.envs.checks.interface import traced
from skillcrew.envs.checks.report import Finding
from skillcrew.envs.checks.subject import Subject
from skillcrew.envs.offers import (
    OffersCentralState,
    OffersCounterfactuals,
    OffersScene,
    OffersSkillTexts,
    offers,
    require,
)
from skillcrew.envs.scene import Scene


def check_offers(subject: Subject) -> Iterator[Finding]:
    """Each offer that is there is of the shape that those who ask for it expect."""
    env = subject.env
    found = []
    for offer, check in (
        (OffersCentralState, _central_state),
        (OffersCounterfactuals, _counterfactuals),
        (OffersScene, _scene),
        (OffersSkillTexts, _skill_texts),
    ):
        if offers(env, offer):
            name, finding = check(subject)
            found.append(name)
            if finding is not None:
                yield finding
    if found:
        yield Finding("fine", "offers", ", ".join(found))


def _central_state(subject: Subject) -> tuple[str, Finding | None]:
    name, finding = "central_state", None
    features, failed = _of_state(subject, require(subject.env, OffersCentralState, name).central_state, name)
    if failed is None and len(getattr(features, "shape", ())) != 1:
        finding = Finding("wrong", name, f"is {_shape(features)}; make it one row of numbers, [features]")
    return name, failed or finding


def _counterfactuals(subject: Subject) -> tuple[str, Finding | None]:
    name, finding = "counterfactual_rewards", None

    offered = require(subject.env, OffersCounterfactuals, name)

    def of_state(state: Any) -> Any:
        return offered.counterfactual_rewards(state, subject.still_of(), subject.key, 0)

    rewards, failed = _of_state(subject, of_state, name)
    if failed is None and getattr(rewards, "shape", None) != (subject.env.n_agents,):
        finding = Finding("wrong", name, f"is {_shape(rewards)}; make it one reward for each agent, [agents]")
    return name, failed or finding


def _scene(subject: Subject) -> tuple[str, Finding | None]:
    name, finding = "scene", None
    scene, failed = _of_state(subject, require(subject.env, OffersScene, name).scene, name)
    if failed is None and not isinstance(scene, Scene):
        finding = Finding("wrong", name, f"returns {type(scene).__name__}; return a skillcrew.Scene")
    return name, failed or finding


def _skill_texts(subject: Subject) -> tuple[str, Finding | None]:
    name, skills = "skill_texts", subject.env.skills
    texts = require(subject.env, OffersSkillTexts, name).skill_texts
    missing = [skill for skill in skills if skill not in texts]
    unknown = [skill for skill in texts if skill not in skills]
    if missing:
        return name, Finding("note", name, f"says nothing of {', '.join(missing)}; add a sentence")
    if unknown:
        return name, Finding("note", name, f"is of no skill: {', '.join(unknown)}; leave it out")
    return name, None


def _of_state(subject: Subject, function: Callable[[Any], Any], name: str) -> tuple[Any, Finding | None]:
    state = jax.eval_shape(lambda key: subject.env.reset(key)[0], subject.key)
    return traced(name, function, state)


def _shape(value: Any) -> str:
    return f"of the shape {value.shape}" if hasattr(value, "shape") else type(value).__name__
