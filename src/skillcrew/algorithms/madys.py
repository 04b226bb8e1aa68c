"""MADyS: Multiagent Learning via Dynamic Skill Selection (thesis, chapter 3, Algorithm 1).

An evolutionary algorithm searches over teams of selectors for the sparse team reward; at every
step each agent's selector picks one of K skills; each skill is trained by TD3 on its own dense
local reward, from the one buffer that the evolving teams fill. Team reward: evolution only.
Local rewards: gradients only.
"""

import dataclasses

import jax
from jaxtyping import Array

from skillcrew.algorithms.skill_teams import SkillTeams, SkillTeamsConfig, SkillTeamsState
from skillcrew.policies.selector import AnySelector
from skillcrew.policies.team import SkillTeam
from skillcrew.rollout import count_steps


@dataclasses.dataclass(frozen=True)
class MADySConfig(SkillTeamsConfig):
    """Options of MADyS."""


class MADyS(SkillTeams):
    """Teams of selectors evolve on the team reward; shared skills learn by TD3 on local rewards.

    `MADyS(env, population=60)` overrides fields of `MADySConfig`.

    Raises:
        UserError: an unknown field or skill, or a value that a field refuses.
    """

    name = "madys"
    label = "MADyS"
    config_class = MADySConfig

    def step(self, state: SkillTeamsState) -> tuple[SkillTeamsState, dict[str, Array]]:
        """One generation: the body of Algorithm 1."""
        key, key_start, key_rollout, key_evolution, key_skills = jax.random.split(state.key, 5)
        skills = state.skills.in_use()

        def make_team(selectors: AnySelector) -> SkillTeam:
            return self._team_of(selectors, skills)

        # Lines 6 to 9 (and Algorithm 2): every team lives the same fresh episodes into the buffer, with noise
        # while any skill learns.
        learning = ~state.skills.plateau.stopped.all()
        episodes, recorded, taken = self._live(state, make_team, learning, key_start, key_rollout)

        # Lines 9 to 15: fitness is the mean team return g; rank, elites, tournament, crossover, mutation.
        noise = self._skills.noise(learning)
        search, measured = self._search.evolve(key_evolution, state.search, episodes, make_team, noise=noise)

        # Lines 16 to 22: each skill learns on its local reward, unless its return stopped improving.
        generation = state.generation + 1
        learned, returns = self._skills.learn(key_skills, state.skills, recorded, generation)

        steps = count_steps(state.environment_steps, taken, measured.pop("race_steps", 0))
        state = SkillTeamsState(key, search, learned, generation, steps)
        return state, {"environment_steps": steps, **measured, **returns}
