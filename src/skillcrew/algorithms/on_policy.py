"""What IPPO, MAPPO, COMA and LIIR have in common: a team that lives episodes and learns from just these.

Its agents give primitive actions, or choose among skills that learn beside them as those of MADyS do.
"""

import dataclasses
from typing import Any, Literal

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, Key

from skillcrew.algorithms.algorithm import override
from skillcrew.algorithms.skill_learning import SkillConfig, SkillLearning, SkillState
from skillcrew.credit.difference import credited
from skillcrew.credit.reward import LearnedReward
from skillcrew.envs.environment import Environment
from skillcrew.envs.padded import types_of_agents
from skillcrew.errors import UserError, unknown_name
from skillcrew.learners.on_policy.experience import Experience
from skillcrew.learners.on_policy.learner import OnPolicyLearner
from skillcrew.learners.on_policy.networks import Players
from skillcrew.policies.holding import decided
from skillcrew.policies.memory import PolicyConfig, dealt_out
from skillcrew.policies.stochastic import Options, StochasticTeam
from skillcrew.replay import most_transitions
from skillcrew.rollout import Episodes, Lineup, Start, Trajectories, count_steps, rollout


def _shared() -> PolicyConfig:
    return PolicyConfig(hidden=(64, 64), sharing="team")


@dataclasses.dataclass(frozen=True)
class OnPolicyConfig(SkillConfig):
    """What agents decide among, what they are paid, and what they live before each update."""

    choose: Literal["skills", "actions"] = "actions"
    """Among what agents decide: "skills", which learn beside them as in MADyS, or their primitive
    "actions"."""
    hold: int = 1
    """Least number of steps for which a chosen skill is kept; 1 decides anew at every step."""
    reward: str = "team"
    """What each agent maximises: "team"; "local" for the sum of its local rewards; skills joined by + for the
    sum of those; or its part of the team's, "D" or "D++"."""
    episodes: int = 64
    """Episodes per generation, from which policies learn."""
    policy: PolicyConfig = dataclasses.field(default_factory=_shared)
    """The agents' policies."""
    critic: PolicyConfig = dataclasses.field(default_factory=_shared)
    """The critics. Give them memory where policies have it: a critic that cannot tell what was done before
    misleads policies that can."""
    greedy: bool = False
    """Whether the champion takes the most probable action, instead of drawing one as it did to learn."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.choose not in ("skills", "actions"):
            raise unknown_name("choose", str(self.choose), ("skills", "actions"))
        for field in ("hold", "episodes"):
            if getattr(self, field) < 1:
                raise UserError(f"{field} = {getattr(self, field)}: give at least 1")
        if self.hold > 1 and self.choose == "actions":
            raise UserError(f"hold = {self.hold}: skills are held, not actions; set choose to skills")
        if self.choose == "skills":
            self.check_episodes(self.episodes)

    def unused(self, env: Environment) -> set[str]:
        """Names of what is not looked at: all that is said of skills, where none are chosen."""
        if self.choose == "skills":
            return super().unused(env)
        return {field.name for field in dataclasses.fields(SkillConfig)}


class OnPolicyTeamState(eqx.Module):
    """All that goes from one generation to the next."""

    key: Key[Array, ""]
    learner: Any
    skills: SkillState | None
    """None where no skills are chosen."""
    generation: Int[Array, ""]
    environment_steps: Int[Array, ""]


class OnPolicyTeam:
    """One team that learns by policy gradient; `_make_learner` is the subclasses'.

    Raises:
        UserError: an unknown field, skill or reward, or a value that a field refuses.
    """

    name: str
    label: str
    config_class: Any

    def __init__(self, env: Environment, config: Any = None, **overrides: Any):
        self.env = env
        self.config = override(self, config, overrides)
        self._skills = SkillLearning(env, self.config) if self.config.choose == "skills" else None
        if self._skills:
            self.label = f"{type(self).label} over skills"
        self._lived_in = credited(env, self.config.reward)
        self._reward = LearnedReward(self._lived_in, self.config.reward)
        self._options = self._decided_among()
        players = Players(env.n_agents, env.observation_size, self._options, types_of_agents(env))
        self._learner = self._make_learner(players)
        if self._skills:
            self._skills.reserve(self.config.episodes + self._skills.probe_worlds)

    def choices(self) -> tuple[str, ...]:
        """Names of the skills, or one name for the index 0 that every choice is."""
        return self._skills.names if self._skills else ("primitive_action",)

    def init(self, key: Key[Array, ""]) -> OnPolicyTeamState:
        """Policies that do everything alike, random skills, an empty buffer."""
        key_learner, key_skills, key = jax.random.split(key, 3)
        skills = self._skills.init(key_skills) if self._skills else None
        zero = jnp.zeros((), jnp.int32)
        return OnPolicyTeamState(key, self._learner.init(key_learner), skills, zero, zero)

    def step(self, state: OnPolicyTeamState) -> tuple[OnPolicyTeamState, dict[str, Array]]:
        """One generation: episodes of the team as it is, then updates of policies, critics and skills."""
        key, key_start, key_rollout, key_learn, key_skills = jax.random.split(state.key, 5)
        lived, trajectories = self._live(state, key_start, key_rollout)
        own = trajectories.worlds(slice(self.config.episodes))
        learner, measured = self._learner.update(state.learner, self._experience(own), key_learn)
        generation, skills = state.generation + 1, state.skills
        if self._skills and skills is not None:
            without_credit = trajectories.local_rewards[..., : len(self.env.skills)]
            for_skills = dataclasses.replace(trajectories, local_rewards=without_credit)
            probed = ~skills.plateau.stopped
            skills, returns = self._skills.learn(key_skills, skills, for_skills, generation, probed=probed)
            measured = {**measured, **returns}
        steps = count_steps(state.environment_steps, lived.steps())
        of_team = own.team_return()
        fitness = {"fitness_best": of_team.max(), "fitness_mean": of_team.mean()}
        after = OnPolicyTeamState(key, learner, skills, generation, steps)
        return after, {"environment_steps": steps, **fitness, **measured}

    def team(self, state: OnPolicyTeamState) -> StochasticTeam:
        """The policies as they stand, without what they do only to explore."""
        return self._team(state, jnp.zeros(()), self.config.greedy)

    def transient_bytes(self) -> int:
        """What a generation takes beside the state: what was lived, and what networks make of a minibatch."""
        config, env = self.config, self.env
        units = (sum(network.hidden) + network.memory for network in (config.policy, config.critic))
        made = 6 * sum(units) // self._learner.config.minibatches
        # Critics may see what all agents see, twice over while minibatches are dealt out.
        seen = (4 + 2 * env.n_agents) * env.observation_size
        needed = 4 * most_transitions(env, config.episodes) * (made + seen)
        if not self._skills:
            return needed
        return needed + self._skills.transient_bytes(config.episodes + self._skills.probe_worlds)

    def _make_learner(self, players: Players) -> OnPolicyLearner:
        raise NotImplementedError

    def _team(self, state: OnPolicyTeamState, floor: Float[Array, ""], greedy: bool) -> StochasticTeam:
        return StochasticTeam(
            dealt_out(state.learner.policies, types_of_agents(self.env), self.config.policy),
            None if state.skills is None else state.skills.in_use(),
            floor,
            self._options,
            self.env.n_agents,
            self.config.hold,
            greedy,
        )

    def _live(
        self, state: OnPolicyTeamState, key_start: Key[Array, ""], key_rollout: Key[Array, ""]
    ) -> tuple[Episodes, Trajectories]:
        """The team's own episodes and, in worlds after them, each skill by itself that still learns.

        Else these would be a quarter of all steps to the end; beside a population they are a tenth.
        """
        start = Start.draw(self._lived_in, key_start, self.config.episodes)
        explorers = self._team(state, self._learner.floor(state.learner), greedy=False)
        lineup = Lineup.of_team(explorers, start)
        if not self._skills or state.skills is None:
            return rollout(self._lived_in, lineup, key_rollout)
        lineup = lineup.beside(self._skills.probes(state.skills, start))
        learning = ~state.skills.plateau.stopped
        lived = jnp.append(jnp.ones(self.config.episodes, bool), self._skills.worlds_of(learning))
        return rollout(self._lived_in, lineup, key_rollout, self._skills.noise(learning.any()), lived=lived)

    def _experience(self, lived: Trajectories) -> Experience:
        taken = self._taken(lived)
        return Experience.create(
            lived.observation,
            lived.next_observation,
            taken,
            self._paid(lived),
            lived.terminated,
            lived.mask,
            decided(taken, self.config.hold) if self._skills else self._always(lived),
        )

    def _taken(self, lived: Trajectories) -> Array:
        """What each agent decided: a skill, a discrete action, or numbers."""
        if self._skills:
            return lived.choice
        return jnp.argmax(lived.action, axis=-1).astype(jnp.int32) if self.env.choices else lived.action

    def _paid(self, lived: Trajectories) -> Float[Array, "time worlds agents"]:
        """The one number of each step that each agent maximises."""
        everybodys = jnp.broadcast_to(lived.team_reward[..., None], lived.choice.shape)
        return self._reward(lived.local_rewards, everybodys)

    def _always(self, lived: Trajectories) -> Bool[Array, "time worlds agents"]:
        return jnp.ones(lived.choice.shape, bool)

    def _decided_among(self) -> Options:
        if not self._skills:
            size = self.env.choices or self.env.action_size
            return Options(size, continuous=not self.env.choices)
        repertoire = self._skills.repertoire
        available = tuple(zip(*repertoire.users, strict=True)) if repertoire else ()
        return Options(self._skills.n_skills, available=available)
