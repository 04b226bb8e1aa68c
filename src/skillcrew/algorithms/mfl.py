"""MFL: Multi-fitness Learning, in the form that the thesis compares with (sections 2.2.5 and 4.2).

The same teams of selectors over the same skills as in MADyS, but one after the other: skills are
trained first, from the experience of agents that choose among them at random; then they are frozen,
and selectors evolve. What the pre-training costs counts as environment steps.
"""

import dataclasses

import jax
import jax.numpy as jnp
from jaxtyping import Array

from skillcrew.algorithms.skill_teams import SkillTeams, SkillTeamsConfig, SkillTeamsState
from skillcrew.errors import UserError
from skillcrew.policies.selector import AnySelector
from skillcrew.policies.team import WanderingTeam
from skillcrew.rollout import count_steps


@dataclasses.dataclass(frozen=True)
class MFLConfig(SkillTeamsConfig):
    """Options of MFL."""

    pretraining_steps: int = 600_000
    """Environment steps for which the skills are trained before selectors evolve."""
    exploration_change: float = 0.1
    """Probability per step that an agent, while skills are trained, draws a skill anew from all of them."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.pretraining_steps < 1:
            raise UserError(f"pretraining_steps = {self.pretraining_steps}: give at least 1")
        if not 0 < self.exploration_change <= 1:
            raise UserError(
                f"exploration_change = {self.exploration_change}: give a probability above 0 and up to 1"
            )


class MFL(SkillTeams):
    """Skills are trained first, on local rewards; then they are frozen, and teams of selectors evolve.

    `MFL(env, pretraining_steps=1_000_000)` overrides fields of `MFLConfig`.

    Raises:
        UserError: an unknown field or skill, or a value that a field refuses.
    """

    name = "mfl"
    label = "MFL"
    config_class = MFLConfig

    def step(self, state: SkillTeamsState) -> tuple[SkillTeamsState, dict[str, Array]]:
        """One generation, of pre-training or of evolution."""
        key, key_start, key_rollout, key_evolution, key_skills = jax.random.split(state.key, 5)
        skills = state.skills.in_use()
        pretraining = state.environment_steps < self.config.pretraining_steps

        def make_team(selectors: AnySelector) -> WanderingTeam:
            team = self._team_of(selectors, skills)
            return WanderingTeam(team, pretraining, self.config.exploration_change)

        episodes, recorded, taken = self._live(state, make_team, pretraining, key_start, key_rollout)
        evolved, measured = self._search.evolve(key_evolution, state.search, episodes, make_team)
        search = jax.tree.map(lambda old, new: jnp.where(pretraining, old, new), state.search, evolved)
        generation = state.generation + 1
        learned, returns = self._skills.learn(key_skills, state.skills, recorded, generation, ~pretraining)

        # Nothing is bred while skills are trained, so there is nothing that a race would decide.
        raced = jnp.where(pretraining, 0, measured.pop("race_steps", 0))
        steps = count_steps(state.environment_steps, taken, raced)
        state = SkillTeamsState(key, search, learned, generation, steps)
        return state, {"environment_steps": steps, "pretraining": pretraining, **measured, **returns}
