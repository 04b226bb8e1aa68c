"""What MADyS and MFL have in common: teams of selectors over skills that learn."""

import dataclasses
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Int, Key

from skillcrew.algorithms.algorithm import override
from skillcrew.algorithms.skill_learning import SkillConfig, SkillLearning, SkillState
from skillcrew.algorithms.team_search import SearchConfig, TeamSearch
from skillcrew.envs.environment import Environment
from skillcrew.envs.padded import types_of_agents
from skillcrew.evolution.phases import PhaseVariation
from skillcrew.policies.dispatch import Skills
from skillcrew.policies.memory import collected, dealt_out
from skillcrew.policies.population import GenomeCodec
from skillcrew.policies.selector import AnySelector, SelectorConfig, create_selector
from skillcrew.policies.team import SkillTeam, Team
from skillcrew.rollout import Episodes, Trajectories, rollout


@dataclasses.dataclass(frozen=True)
class SkillTeamsConfig(SearchConfig, SkillConfig):
    """Options of the search for selectors, and of the skills."""

    selector: SelectorConfig = dataclasses.field(default_factory=SelectorConfig)
    """The selectors."""

    def __post_init__(self) -> None:
        # A `PolicyConfig` was all that there was to say of a selector once.
        object.__setattr__(self, "selector", SelectorConfig.of(self.selector))
        SearchConfig.__post_init__(self)
        SkillConfig.__post_init__(self)
        self.check_episodes(self.episodes)

    def unused(self, env: Environment) -> set[str]:
        """Names of the sections that are not looked at in such an environment."""
        return SearchConfig.unused(self, env) | SkillConfig.unused(self, env)


class SkillTeamsState(eqx.Module):
    """All that goes from one generation to the next."""

    key: Key[Array, ""]
    search: Any
    """The evolver's: the population, and what is known of it."""
    skills: SkillState
    generation: Int[Array, ""]
    environment_steps: Int[Array, ""]


class SkillTeams:
    """Teams of selectors that evolve, and the skills that they select; `step` is the subclasses'.

    Raises:
        UserError: an unknown field or skill, or a value that a field refuses.
    """

    name: str
    label: str
    config_class: Any

    def __init__(self, env: Environment, config: Any = None, **overrides: Any):
        self.env = env
        self.config = override(self, config, overrides)
        self._skills = SkillLearning(env, self.config)
        selector = self.config.selector
        selector.check_episode(env.episode_length)
        codec = GenomeCodec(self._create_selector, selector.networks(env), selector.alike)
        self._search = TeamSearch(env, codec, self.config, self._vary if selector.phases else None)
        self._skills.reserve(self._recorded_worlds())

    def choices(self) -> tuple[str, ...]:
        return self._skills.names

    def init(self, key: Key[Array, ""]) -> SkillTeamsState:
        """Lines 1 to 4 of Algorithm 1: random teams, random skills, an empty buffer."""
        key_teams, key_skills, key = jax.random.split(key, 3)
        return SkillTeamsState(
            key=key,
            search=self._search.init(key_teams),
            skills=self._skills.init(key_skills),
            generation=jnp.zeros((), jnp.int32),
            environment_steps=jnp.zeros((), jnp.int32),
        )

    def team(self, state: SkillTeamsState) -> SkillTeam:
        """The champion of the population, with the skills in use now."""
        return self._team_of(self._search.champion(state.search), state.skills.in_use())

    def selectors(self, team: SkillTeam) -> AnySelector:
        """A team's own, as they evolve: one for each agent, or as many as agents share."""
        return collected(team.selectors, types_of_agents(self.env), self.config.selector)

    def begin_around(self, state: SkillTeamsState, selectors: AnySelector) -> SkillTeamsState:
        """A state before the first generation whose search begins around such selectors, not random ones."""
        key_teams, key = jax.random.split(state.key)
        return dataclasses.replace(state, key=key, search=self._search.init(key_teams, selectors))

    def transient_bytes(self) -> int:
        """What a generation takes beside the state."""
        return self._skills.transient_bytes(self._recorded_worlds())

    def _team_of(self, selectors: AnySelector, skills: Skills) -> SkillTeam:
        """The team of such selectors and skills."""
        repertoire = self._skills.repertoire
        selectors = dealt_out(selectors, types_of_agents(self.env), self.config.selector)
        return SkillTeam(selectors, skills, self.env.n_agents, repertoire.of_agents if repertoire else ())

    def _live(
        self,
        state: SkillTeamsState,
        make_team: Callable[[AnySelector], Team],
        learning: Bool[Array, ""],
        key_start: Key[Array, ""],
        key_rollout: Key[Array, ""],
    ) -> tuple[Episodes, Trajectories, Int[Array, ""]]:
        """Every team lives its fresh episodes and, in the worlds after theirs, each skill on its own.

        Args:
            learning: whether actions are noisy, for skills to learn from.

        Returns:
            The teams' episodes, what enters the buffer, and the environment steps of all worlds.
        """
        start = self._search.start(key_start)
        lineup = self._search.lineup(state.search, start, make_team)
        lineup = lineup.beside(self._skills.probes(state.skills, start))
        noise = self._skills.noise(learning)
        episodes, recorded = rollout(self.env, lineup, key_rollout, noise, self._recorded())
        return episodes.worlds(slice(self._search.worlds)), recorded, episodes.steps()

    def _recorded(self) -> slice | np.ndarray:
        """The worlds whose transitions enter the buffer: of each team its first few, and all probes."""
        recorded = self.config.recorded_episodes
        if recorded is None or recorded == self.config.episodes:
            return slice(None)
        of_teams = np.arange(self._search.worlds).reshape(self.config.population, -1)[:, :recorded]
        of_probes = self._search.worlds + np.arange(self._skills.probe_worlds)
        return np.concatenate([of_teams.ravel(), of_probes])

    def _recorded_worlds(self) -> int:
        # As many as `_recorded` takes, without a list of them: a slip may ask for more than fit anywhere.
        of_team = range(self._search.worlds // self.config.population)[: self.config.recorded_episodes]
        return self.config.population * len(of_team) + self._skills.probe_worlds

    def _vary(self, networks: int) -> PhaseVariation:
        phases = self.config.selector.phases
        return PhaseVariation(self.config.evolution.phases, networks, phases, self._skills.n_choices)

    def _create_selector(self, key: Key[Array, ""]) -> AnySelector:
        env = self.env
        return create_selector(
            key, env.observation_size, self._skills.n_choices, env.episode_length, self.config.selector
        )
