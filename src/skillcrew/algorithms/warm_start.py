"""What a run may begin with that another run has learned: its skills, or its team."""

import dataclasses
from typing import Any

import jax.numpy as jnp

from skillcrew.algorithms.algorithm import Algorithm
from skillcrew.algorithms.skill_learning import SkillConfig, SkillState
from skillcrew.algorithms.skill_teams import SkillTeams
from skillcrew.envs.environment import Environment
from skillcrew.envs.offers import OffersObservationNames, offers, require
from skillcrew.errors import UserError
from skillcrew.learners.learner import LearnerState
from skillcrew.learners.transfer import begin_with
from skillcrew.policies.rewiring import Inputs


@dataclasses.dataclass(frozen=True)
class SkillTransfer:
    """Which skills begin with the networks of another run's, and where these find their inputs."""

    names: tuple[str, ...]
    """Of the skills that are taken over."""
    places: dict[int, int]
    """Of each of these, by its index here: its index there."""
    inputs: dict[int, Inputs]
    """Of the same: where each number that it sees stands in what it saw there."""
    observation_size: int
    """There."""
    lost: tuple[str, ...]
    """What any of these skills saw there, and for which there is nothing here."""

    @classmethod
    def between(cls, algorithm: Algorithm, other: Algorithm) -> "SkillTransfer":
        """From another run's algorithm to one that is to begin.

        Raises:
            UserError: one of them has no skills, none of the same name, or theirs do not fit.
        """
        if not _has_skills(algorithm):
            raise UserError(f"{algorithm.name} has no skills that could begin with others")
        if not _has_skills(other):
            raise UserError(f"{other.name} on {other.env.name} has no skills")
        own, theirs = algorithm.choices(), other.choices()
        names = tuple(name for name in own if name in theirs)
        if not names:
            raise UserError(f"its skills are {', '.join(theirs)}, and here {', '.join(own)}; none is in both")
        _check_learners(algorithm, other)
        return cls(
            names,
            {own.index(name): theirs.index(name) for name in names},
            {own.index(name): _inputs(algorithm.env, other.env, name) for name in names},
            other.env.observation_size,
            tuple(dict.fromkeys(lost for name in names for lost in _lost(algorithm.env, other.env, name))),
        )

    def begin(self, state: SkillState, learners: LearnerState, frozen: bool) -> SkillState:
        """Skills of which those that are taken over begin with the networks of the others.

        Args:
            state: before the first generation.
            learners: of the other run; leaves have a leading skill axis.
            frozen: whether what is taken over learns no more.
        """
        begun = begin_with(state.learners, learners, self.places, self.inputs, self.observation_size)
        plateau = state.plateau
        if frozen:
            stopped_at = plateau.stopped_at.at[jnp.array(list(self.places))].set(0)
            plateau = dataclasses.replace(plateau, stopped_at=stopped_at)
        return dataclasses.replace(state, learners=begun, plateau=plateau)


def team_between(algorithm: Algorithm, other: Algorithm) -> SkillTeams:
    """The other run's algorithm, if its teams can be the first of one that is to begin.

    Raises:
        UserError: no selectors, other skills, or selectors of another structure.
    """
    here, there = _with_selectors(algorithm), _with_selectors(other)
    own, theirs = here.choices(), there.choices()
    if own != theirs:
        raise UserError(f"its selectors choose among {', '.join(theirs)}, and here among {', '.join(own)}")
    selector, before = here.config.selector, there.config.selector
    # How a random team begins makes no difference to what a selector is.
    _check_same(dataclasses.replace(before, alike=selector.alike), selector, "algorithm.selector")
    if selector.networks(here.env) != before.networks(there.env):
        raise UserError(
            f"its teams have a selector for each of {there.env.n_agents} agents, and here there are "
            f"{here.env.n_agents}; only one that all agents share suits other numbers "
            "(algorithm.selector.sharing = team, in both runs)"
        )
    _check_observations(here.env, there.env)
    return there


def _with_selectors(algorithm: Algorithm) -> SkillTeams:
    if isinstance(algorithm, SkillTeams):
        return algorithm
    known = "madys, madys-plus, madys-es, open-loop and mfl have"
    raise UserError(f"{algorithm.name} has no selectors; {known}")


def _has_skills(algorithm: Any) -> bool:
    is_learning = isinstance(algorithm.config, SkillConfig)
    return is_learning and getattr(algorithm.config, "choose", "skills") == "skills"


def _check_learners(algorithm: Any, other: Any) -> None:
    """Refuses networks of another structure."""
    env, there = algorithm.env, other.env
    if (env.actions, env.action_size) != (there.actions, there.action_size):
        raise UserError(
            f"its actions are {there.action_size} {there.actions} ones, and here {env.action_size} "
            f"{env.actions}"
        )
    section, fields = ("dqn", ("network", "dueling")) if env.choices else ("learner", ("network", "critics"))
    for field in fields:
        was, now = (getattr(getattr(one.config, section), field) for one in (other, algorithm))
        _check_same(was, now, f"algorithm.{section}.{field}")


def _check_same(was: Any, now: Any, name: str) -> None:
    """Refuses a part of a configuration that differs, by the name of the innermost field that does."""
    if was == now:
        return
    if dataclasses.is_dataclass(now):
        for field in dataclasses.fields(now):
            _check_same(getattr(was, field.name), getattr(now, field.name), f"{name}.{field.name}")
    raise UserError(f"its {name} is {was}, and here {now}; set it to the same")


def _inputs(env: Environment, there: Environment, skill: str) -> Inputs:
    """Where each number that a skill sees stands in what it saw there."""
    own, theirs = _names(env, skill), _names(there, skill)
    if own is None or theirs is None:
        if env.observation_size != there.observation_size:
            lacks = env if own is None else there
            raise UserError(
                f"{skill} sees {there.observation_size} numbers there and {env.observation_size} here; "
                "which is which only environments say that offer observation_names, as "
                f"{lacks.name} does not"
            )
        return tuple(range(env.observation_size))
    inputs = tuple(theirs.index(name) if name in theirs else None for name in own)
    if set(inputs) == {None}:
        raise UserError(f"nothing that {skill} sees there, such as '{theirs[0]}', is seen here")
    return inputs + (None,) * (env.observation_size - len(own))


def _lost(env: Environment, there: Environment, skill: str) -> list[str]:
    """What a skill saw there and does not see here, by name."""
    own, theirs = _names(env, skill), _names(there, skill)
    return [] if own is None or theirs is None else [name for name in theirs if name not in own]


def _names(env: Environment, skill: str) -> tuple[str, ...] | None:
    """What each number is that those see who have a skill; None where the environment does not say."""
    if not offers(env, OffersObservationNames):
        return None
    names: Any = require(env, OffersObservationNames, "a warm start").observation_names
    return tuple(names[skill.partition("/")[0]] if env.types else names)


def _check_observations(env: Environment, there: Environment) -> None:
    """Refuses selectors that would see anything else than they did."""
    if env.observation_size != there.observation_size:
        raise UserError(
            f"its selectors see {there.observation_size} numbers, and here there are {env.observation_size}"
        )
    for skill in env.skills:
        own, theirs = _names(env, skill), _names(there, skill)
        if own and theirs and own != theirs:
            was, now = next(pair for pair in zip(theirs, own, strict=True) if pair[0] != pair[1])
            raise UserError(f"its selectors see '{was}' where there is '{now}' here")
