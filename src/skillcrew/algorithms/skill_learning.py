"""The gradient half of MADyS and MFL: K skills, each learning on its own local reward from one buffer."""

import dataclasses
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, Key

from skillcrew.algorithms.repertoire import Repertoire
from skillcrew.algorithms.skill_training import train_skills
from skillcrew.credit.difference import CREDITS
from skillcrew.envs.environment import Environment
from skillcrew.errors import UserError, unknown_name
from skillcrew.learners.dqn import DQNConfig
from skillcrew.learners.learner import LearnerState, make_learner, unused_learner
from skillcrew.learners.plateau import Plateau, PlateauConfig, gone_on, mean_return
from skillcrew.learners.td3 import TD3Config
from skillcrew.learners.training import round_bytes
from skillcrew.policies.dispatch import Skills
from skillcrew.policies.team import FixedChoiceTeam
from skillcrew.replay import ReplayBuffer, capacity_for, most_transitions, transitions_of
from skillcrew.rollout import Lineup, Start, Trajectories


@dataclasses.dataclass(frozen=True)
class SkillConfig:
    """Which skills there are, and how they learn."""

    skills: tuple[str, ...] | None = None
    """Skills to choose among, by name. Default: all that the environment has."""
    probe_episodes: int = 3
    """Episodes per skill and generation in which all agents use that skill alone, which measure its return
    R_k. They count as environment steps."""
    updates: int = 100
    """Critic updates per skill and generation; a multiple of learner.policy_delay."""
    task_ends_skills: bool = False
    """Whether a skill's value ends where the team's task is done, as the episode does; what it is paid for
    does not. With it "go to" skills learn to wait just outside the last goal."""
    exploration_noise: float = 0.3
    """Standard deviation of the noise on primitive actions while teams are evaluated, or how likely each
    discrete action is a random one, until all skills have stopped learning."""
    buffer_capacity: int | None = None
    """Transitions that the shared buffer holds; a transition is of one agent. Default: 300,000, or those of
    two generations where they are more."""
    recorded_episodes: int | None = None
    """Episodes of each team and generation whose transitions enter the buffer. Default: all."""
    learner: TD3Config = dataclasses.field(
        default_factory=lambda: TD3Config(
            discount=0.8,
            actor_learning_rate=3e-3,
            critic_learning_rate=3e-3,
            target_noise=0.6,
            target_noise_clip=1.0,
            saturation_penalty=0.003,
        )
    )
    """How skills learn. What differs from `TD3Config`, and why: docs/algorithms/madys.md."""
    dqn: DQNConfig = dataclasses.field(default_factory=lambda: DQNConfig(discount=0.8, soft_update=0.01))
    """How they learn where actions are discrete."""
    plateau: PlateauConfig = dataclasses.field(default_factory=PlateauConfig)
    """When a skill stops learning."""

    def __post_init__(self) -> None:
        for field in ("probe_episodes", "updates", "buffer_capacity", "recorded_episodes"):
            value = getattr(self, field)
            if value is not None and value < 1:
                raise UserError(f"{field} = {value}: give at least 1")
        if not self.exploration_noise >= 0:
            raise UserError(f"exploration_noise = {self.exploration_noise}: give a number of at least 0")
        if self.updates % self.learner.policy_delay:
            raise UserError(
                f"updates = {self.updates}: give a multiple of learner.policy_delay = "
                f"{self.learner.policy_delay}"
            )

    def unused(self, env: Environment) -> set[str]:
        """The name of the section of the learner that does not suit the environment's actions."""
        return {unused_learner(env.choices)}

    def check_episodes(self, episodes: int) -> None:
        """Raises `UserError` if more are to be probed or recorded than there are in a generation."""
        if self.probe_episodes > episodes:
            raise UserError(
                f"probe_episodes = {self.probe_episodes}: above episodes = {episodes}, of which they "
                "are the first; lower probe_episodes or raise episodes"
            )
        if self.recorded_episodes is not None and self.recorded_episodes > episodes:
            raise UserError(
                f"recorded_episodes = {self.recorded_episodes}: above episodes = {episodes}; lower it"
            )


class SkillState(eqx.Module):
    """The skills, how they have come along, and what they learn from."""

    learners: LearnerState
    """Leaves have a leading skill axis."""
    plateau: Plateau
    experience: Any
    """The shared buffer's contents."""

    def in_use(self) -> Skills:
        """The skills Π_k that teams act by: the slowly following target actors Π'_k, not the latest ones.

        Selectors evolve for the skills as they are, and the latest actors change in each generation by
        more than a selector can follow. Measured on rover-t2-c1 after 2 M steps: champions of 0.34 to 0.92
        on the latest actors (4 seeds, lineage_inheritance 0), 0.88 to 0.94 on their targets (5 seeds, 0.2).
        """
        return self.learners.target_actor


class SkillLearning:
    """K skills that learn from what teams live.

    Raises:
        UserError: a skill that the environment lacks.
    """

    def __init__(self, env: Environment, config: SkillConfig):
        self.config = config
        self._env = env
        self._indices = skill_indices(env, config.skills)
        self._learner = make_learner(
            config.learner, config.dqn, env.observation_size, env.action_size, env.choices
        )
        self.repertoire = Repertoire.of(env, self.names)
        self.reserve(0)

    @property
    def n_skills(self) -> int:
        return len(self._indices)

    @property
    def n_choices(self) -> int:
        """Among how many skills an agent chooses."""
        return self.repertoire.choices if self.repertoire else self.n_skills

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self._env.skills[index] for index in self._indices)

    @property
    def probe_worlds(self) -> int:
        """Worlds in which skills are probed."""
        return self.n_skills * self.config.probe_episodes

    def reserve(self, worlds: int) -> None:
        """Makes the buffer large enough for generations of so many recorded worlds.

        Raises:
            UserError: that is more than what was asked for.
        """
        env = self._env
        capacity = capacity_for(most_transitions(env, worlds), self.config.buffer_capacity)
        if self.repertoire:
            # Then a row's place says whose it is.
            capacity -= capacity % env.n_agents
        self._buffer = ReplayBuffer(capacity, env.observation_size, env.action_size, self.n_skills)

    def transient_bytes(self, worlds: int) -> int:
        """So many recorded worlds until they are in the buffer, and a round of updates after that."""
        width = self._buffer.width
        return 3 * 4 * most_transitions(self._env, worlds) * width + round_bytes(
            self._learner.config, self.n_skills, width
        )

    def init(self, key: Key[Array, ""]) -> SkillState:
        """Random skills, an empty buffer."""
        return SkillState(
            learners=jax.vmap(self._learner.init)(jax.random.split(key, self.n_skills)),
            plateau=Plateau.create(self.n_skills),
            experience=self._buffer.init(),
        )

    def probes(self, state: SkillState, start: Start) -> Lineup:
        """Each skill on its own in the first few of the worlds, skill by skill."""
        skills = state.in_use()
        partners = self.repertoire.partners if self.repertoire else ()
        return Lineup.of_teams(
            lambda skill: FixedChoiceTeam(skill, skills, self._env.n_agents, partners),
            jnp.arange(self.n_skills, dtype=jnp.int32),
            self.n_skills,
            start.first(self.config.probe_episodes),
        )

    def worlds_of(self, skills: Bool[Array, " skills"]) -> Bool[Array, " probe_worlds"]:
        """The worlds in which some of the skills are probed."""
        return jnp.repeat(skills, self.config.probe_episodes)

    def noise(self, learning: Bool[Array, ""]) -> Float[Array, ""]:
        """Exploration noise: it is there to learn from, and would only blur fitness after that."""
        return jnp.where(learning, self.config.exploration_noise, 0.0)

    def learn(
        self,
        key: Key[Array, ""],
        state: SkillState,
        trajectories: Trajectories,
        generation: Int[Array, ""],
        frozen: Bool[Array, ""] | None = None,
        probed: Bool[Array, " skills"] | None = None,
    ) -> tuple[SkillState, dict[str, Array]]:
        """Lines 16 to 22 of Algorithm 1: each skill learns, unless its return stopped improving.

        Args:
            trajectories: recorded worlds, those of the probes last.
            generation: counted from 1.
            frozen: whether all skills stop learning, whatever their returns.
            probed: the skills whose probes were lived; what the others' last returned stands. None: all.

        Returns:
            The new state, and metrics of each skill.
        """
        if self._indices != tuple(range(len(self._env.skills))):
            trajectories = dataclasses.replace(
                trajectories, local_rewards=trajectories.local_rewards[..., jnp.asarray(self._indices)]
            )
        experience = self._buffer.add(state.experience, *transitions_of(trajectories))
        returns = self._returns(
            trajectories.worlds(slice(trajectories.mask.shape[1] - self.probe_worlds, None))
        )
        if probed is not None:
            returns = jnp.where(probed, returns, state.plateau.smoothed)
        plateau = state.plateau.observe(returns, generation, self.config.plateau)
        if frozen is not None:
            plateau = plateau.stop_all(generation, frozen)
        learners, losses = train_skills(
            key,
            self._learner,
            state.learners,
            plateau.stopped,
            self._buffer,
            experience,
            self.config.updates,
            self.config.task_ends_skills,
            self.repertoire.members if self.repertoire else None,
        )
        state = SkillState(learners, plateau, experience)
        return state, self._metrics(state, returns, losses)

    def _returns(self, probes: Trajectories) -> Float[Array, " skills"]:
        """R_k of each skill, over its own probe episodes and all agents that can use it.

        It ends with the team's task where its value does; see `SkillConfig.task_ends_skills`.
        """
        users = jnp.array(self.repertoire.users) if self.repertoire else None

        def of_skill(skill, rewards, mask):
            mask = jnp.broadcast_to(mask[..., None], rewards.shape[:-1])
            if users is not None:
                mask &= jnp.broadcast_to(users[skill], mask.shape)
            return mean_return(rewards[..., skill], mask, self._learner.config.discount)

        rewards, mask = probes.local_rewards, probes.mask
        if not self.config.task_ends_skills:
            rewards, mask = gone_on(rewards, mask, probes.terminated)
        by_skill = jax.tree.map(
            lambda leaf: leaf.reshape(leaf.shape[0], self.n_skills, -1, *leaf.shape[2:]), (rewards, mask)
        )
        return jax.vmap(of_skill, in_axes=(0, 1, 1))(jnp.arange(self.n_skills), *by_skill)

    def _metrics(self, state: SkillState, returns: Array, losses: dict[str, Array]) -> dict[str, Array]:
        metrics = {"transitions_held": self._buffer.size(state.experience)}
        for index, name in enumerate(self.names):
            metrics[f"return_{name}"] = returns[index]
            metrics[f"stopped_at_{name}"] = state.plateau.stopped_at[index]
            for loss, values in losses.items():
                metrics[f"{loss}_{name}"] = values[index]
        return metrics


def skill_indices(env: Environment, names: tuple[str, ...] | None) -> tuple[int, ...]:
    """Where the skills of these names stand among the environment's local rewards; None is all of them.

    Raises:
        UserError: no name, an unknown one, or one given twice.
    """
    if not env.skills:
        raise UserError(
            f"{env.name} has no skills to select among; give it some, or use what needs none: ea, ccea, erl, "
            "cerl, td3, ddpg, maddpg, matd3, or ippo, mappo and liir with choose = actions"
        )
    names = env.skills if names is None else names
    if not names:
        raise UserError("skills = (): give at least one of " + ", ".join(env.skills))
    for name in names:
        if name in ("team", *CREDITS) and name not in env.skills:
            raise UserError(
                f"skills = {tuple(names)}: a skill learns on a local reward, and {name} is the team's, which "
                "selects among skills; leave it out"
            )
        if name not in env.skills:
            raise unknown_name(f"skill of {env.name}", name, env.skills)
    if len(set(names)) != len(names):
        raise UserError(f"skills = {tuple(names)}: give each name once")
    return tuple(env.skills.index(name) for name in names)
