"""What an environment offers beyond `reset` and `step`, where it does."""

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import jax
import jax.numpy as jnp

from skillcrew.envs.checks.interface import traced
from skillcrew.envs.checks.report import Finding
from skillcrew.envs.checks.subject import Subject
from skillcrew.envs.offers import (
    OffersCentralState,
    OffersCounterfactuals,
    OffersObservationNames,
    OffersScene,
    OffersSkillTexts,
    offers,
    require,
)
from skillcrew.envs.scene_shapes import scene_mistake


def check_offers(subject: Subject) -> Iterator[Finding]:
    """Each offer that is there is of the shape that those who ask for it expect."""
    env = subject.env
    found = []
    for offer, check in (
        (OffersCentralState, _central_state),
        (OffersCounterfactuals, _counterfactuals),
        (OffersObservationNames, _observation_names),
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
    name, finding = "counterfactual_step", None
    offered = require(subject.env, OffersCounterfactuals, name)
    nobody = jnp.zeros(subject.env.n_agents, jnp.int32)

    def of_state(state: Any) -> Any:
        other = offered.counterfactual(state)
        return other, offered.counterfactual_step(state, other, subject.still_of(), subject.key, nobody)

    returned, failed = _of_state(subject, of_state, name)
    if failed is not None:
        return name, failed
    other, after = returned
    if not isinstance(after, tuple) or len(after) != 2:
        said = f"returns {_shape(after)}; return what differs now and the team's reward"
        return name, Finding("wrong", name, said)
    if getattr(after[1], "shape", None) != ():
        finding = Finding("wrong", name, f"pays {_shape(after[1])}; pay the team one reward, a scalar")
    elif jax.tree.map(_kind, after[0]) != jax.tree.map(_kind, other):
        said = "gives back something unlike counterfactual's; keep its structure, shapes and dtypes"
        finding = Finding("wrong", name, said)
    return name, finding


def _observation_names(subject: Subject) -> tuple[str, Finding | None]:
    name, env = "observation_names", subject.env
    given = require(env, OffersObservationNames, name).observation_names
    of_types = [(kind.name, kind.observation_size) for kind in env.types] or [(None, env.observation_size)]
    for kind, size in of_types:
        whose = "" if kind is None else f" of {kind}"
        names = given if kind is None else given.get(kind, ()) if isinstance(given, Mapping) else ()
        if len(names) != size or len(set(names)) != size:
            said = f"has {len(set(names))} different names{whose}; give one for each of the {size} numbers"
            return name, Finding("wrong", name, said)
    return name, None


def _kind(leaf: Any) -> tuple[Any, Any]:
    return leaf.shape, leaf.dtype


def _scene(subject: Subject) -> tuple[str, Finding | None]:
    name, finding = "scene", None
    scene, failed = _of_state(subject, require(subject.env, OffersScene, name).scene, name)
    if failed is None and (mistake := scene_mistake(scene, subject.env.n_agents)) is not None:
        finding = Finding("wrong", name, mistake)
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
