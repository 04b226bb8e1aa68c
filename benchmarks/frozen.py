"""Algorithms whose skills have learned: what is left to measure is the search."""

import dataclasses
from typing import Any

import jax.numpy as jnp

from skillcrew.algorithms.skill_teams import SkillTeamsState


def frozen(state: SkillTeamsState, skills: Any = None) -> SkillTeamsState:
    """The state with skills that learn no more: its own, or these (an `Actor` with a leading skill axis)."""
    plateau, learners = state.skills.plateau, state.skills.learners
    if skills is not None:
        learners = dataclasses.replace(learners, target_actor=skills)
    plateau = dataclasses.replace(plateau, stopped_at=jnp.zeros_like(plateau.stopped_at))
    kept = dataclasses.replace(state.skills, learners=learners, plateau=plateau)
    return dataclasses.replace(state, skills=kept)
