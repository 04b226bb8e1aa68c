"""MADyS: Multiagent Learning via Dynamic Skill Selection (thesis, chapter 3, Algorithm 1).

An evolutionary algorithm searches over teams of selectors for the sparse team reward; at every
step each agent's selector picks one of K skills; each skill is trained by TD3 on its own dense
local reward, from the one buffer that the evolving teams fill. Team reward: evolution only.
Local rewards: gradients only.
"""

import dataclasses
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, Key

from skillcrew.algorithms.skill_learning import skill_indices, train_skills
from skillcrew.envs.environment import Environment
from skillcrew.errors import UserError, unknown_name
from skillcrew.evolution.genetic import EvolutionConfig, GeneticState, next_generation
from skillcrew.learners.plateau import Plateau, PlateauConfig, mean_return
from skillcrew.learners.td3 import TD3, TD3Config, TD3State
from skillcrew.policies.actor import Actor
from skillcrew.policies.network import NetworkConfig
from skillcrew.policies.population import GenomeCodec
from skillcrew.policies.selector import Selector
from skillcrew.policies.team import FixedChoiceTeam, SkillTeam
from skillcrew.replay import ReplayBuffer, transitions_of
from skillcrew.rollout import Start, Trajectories, rollout, side_by_side, stacked_policy


@dataclasses.dataclass(frozen=True)
class MADySConfig:
    """Options of MADyS."""

    population: int = 40
    """Teams of selectors (M)."""
    episodes: int = 5
    """Evaluation episodes per team and generation (num_envs); all teams meet the same ones. Few, for
    lineage averages make up for the noise: 0.40 M steps brought champions to 0.64 with 5, to 0.17
    with 10 (means over 5 seeds)."""
    fitness_discount: float = 0.98
    """Discount per step of the team reward in a team's fitness. 1 is the thesis's plain return; below 1,
    of two teams that both succeed the quicker one ranks higher. Success itself is scored without it. On
    two sets of trained skills of rover-t2-c1, 1 M steps brought champions to 0.916 and 0.908 with 1, to
    0.957 and 0.928 with 0.98 (means over 15 to 20 runs)."""
    probe_episodes: int = 3
    """Episodes per skill and generation in which all agents use that skill alone: they measure
    its return R_k. They count as environment steps and enter the buffer like all others."""
    updates: int = 100
    """Critic updates per skill and generation; a multiple of learner.policy_delay."""
    task_ends_skills: bool = False
    """Whether a skill's value ends where the team's task is done, as the episode does. What a skill is paid
    for does not end there: taught that it does, "go to B" learns to wait just outside the last POI, the
    more so the longer it trains. 7 of 8 seeds of rover-t2-c1 then ended at 0.93 to 0.98 (two of them above
    0.95); without, and with plateau.earliest 30, 5 of 6 ended at 0.96 to 0.97."""
    exploration_noise: float = 0.3
    """Standard deviation of the noise on primitive actions while teams are evaluated, until all skills
    have stopped learning. Measured over 3 seeds: a perfect selector solves 0.96 of rover-t2-c1 within 30
    steps on skills learned with 0.3 (saturation penalty 0.003), 0.83 with 0.1 (penalty 0.001)."""
    buffer_capacity: int = 300_000
    """Transitions that the shared buffer holds; a transition is of one agent."""
    skills: tuple[str, ...] | None = None
    """Skills to choose among, by name. Default: all that the environment has."""
    selector: NetworkConfig = dataclasses.field(default_factory=lambda: NetworkConfig(hidden=(16,)))
    """The selectors' network. Evolved on the same trained skills of rover-t2-c1 for 1 M steps (20 runs
    each), champions solved 0.95 with one hidden layer of 16 units and 0.94 with one of 64."""
    evolution: EvolutionConfig = dataclasses.field(default_factory=EvolutionConfig)
    """How teams of selectors evolve."""
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
    """How skills learn. Without the saturation penalty about every third "go to" skill turns in circles for
    a million steps: the extremes of the turn are one and the same heading. With TD3's published target
    noise (0.2, clip 0.5), small steps and discount 0.9, "go to" skills come to brake just outside the
    activation distance: while a rover hardly drives, its heading is free to be wrong, and with a wrong
    heading driving hardly is best. A perfect selector then solved 0.15 to 0.42 of rover-t2-c1 within 15
    steps (0.6 M steps of training, 5 seeds), 0.44 to 0.49 with these values (0.3 M steps)."""
    plateau: PlateauConfig = dataclasses.field(default_factory=PlateauConfig)
    """When a skill stops learning."""

    def __post_init__(self) -> None:
        for field in ("population", "episodes", "probe_episodes", "updates", "buffer_capacity"):
            if getattr(self, field) < 1:
                raise UserError(f"{field} = {getattr(self, field)}: give at least 1")
        if not 0 < self.fitness_discount <= 1:
            raise UserError(
                f"fitness_discount = {self.fitness_discount}: give a number above 0 and up to 1 (no discount)"
            )
        if not self.exploration_noise >= 0:
            raise UserError(f"exploration_noise = {self.exploration_noise}: give a number of at least 0")
        if self.updates % self.learner.policy_delay:
            raise UserError(
                f"updates = {self.updates}: give a multiple of learner.policy_delay = "
                f"{self.learner.policy_delay}"
            )
        if self.probe_episodes > self.episodes:
            raise UserError(
                f"probe_episodes = {self.probe_episodes}: above episodes = {self.episodes}, of which they "
                "are the first; lower probe_episodes or raise episodes"
            )
        self.evolution.check_population(self.population)


class MADySState(eqx.Module):
    """All that goes from one generation to the next."""

    key: Key[Array, ""]
    evolution: GeneticState
    learners: TD3State
    """Leaves have a leading skill axis."""
    plateau: Plateau
    experience: Any
    """The shared buffer's contents."""
    generation: Int[Array, ""]
    environment_steps: Int[Array, ""]


def skills_in_use(state: MADySState) -> Actor:
    """The skills Π_k that teams act by: the slowly following target actors Π'_k, not the latest ones.

    Selectors evolve for the skills as they are, and the latest actors change in each generation by
    more than a selector can follow. Measured on rover-t2-c1 after 2 M steps: champions of 0.34 to 0.92 on
    the latest actors (4 seeds, lineage_inheritance 0), 0.88 to 0.94 on their targets (5 seeds, 0.2).
    """
    return state.learners.target_actor


class MADyS:
    """Teams of selectors evolve on the team reward; shared skills learn by TD3 on local rewards.

    `MADyS(env, population=60)` overrides fields of `MADySConfig`.

    Raises:
        UserError: an unknown field or skill, or a value that a field refuses.
    """

    name = "madys"
    config_class = MADySConfig

    def __init__(self, env: Environment, config: MADySConfig | None = None, **overrides: Any):
        fields = [field.name for field in dataclasses.fields(MADySConfig)]
        for field in overrides:
            if field not in fields:
                raise unknown_name("field of madys", field, fields)
        self.env = env
        self.config = dataclasses.replace(config or MADySConfig(), **overrides)
        self._skill_indices = skill_indices(env, self.config.skills)
        self._codec = GenomeCodec(self._create_selector, env.n_agents)
        self._learner = TD3(self.config.learner, env.observation_size, env.action_size)
        self._buffer = ReplayBuffer(
            self.config.buffer_capacity, env.observation_size, env.action_size, len(self._skill_indices)
        )
        if self._transitions_per_generation() > self.config.buffer_capacity:
            raise UserError(
                f"buffer_capacity = {self.config.buffer_capacity}: smaller than the "
                f"{self._transitions_per_generation()} transitions of one generation; raise it"
            )

    def choices(self) -> tuple[str, ...]:
        return tuple(self.env.skills[index] for index in self._skill_indices)

    def init(self, key: Key[Array, ""]) -> MADySState:
        """Lines 1 to 4: random teams, random skills, an empty buffer."""
        key_teams, key_skills, key = jax.random.split(key, 3)
        n_skills = len(self._skill_indices)
        return MADySState(
            key=key,
            evolution=GeneticState.create(self._codec.create(key_teams, self.config.population)),
            learners=jax.vmap(self._learner.init)(jax.random.split(key_skills, n_skills)),
            plateau=Plateau.create(n_skills),
            experience=self._buffer.init(),
            generation=jnp.zeros((), jnp.int32),
            environment_steps=jnp.zeros((), jnp.int32),
        )

    def step(self, state: MADySState) -> tuple[MADySState, dict[str, Array]]:
        """One generation: the body of Algorithm 1."""
        key, key_start, key_rollout, key_evolution, key_skills = jax.random.split(state.key, 5)

        # Lines 6 to 9: every team lives the same fresh episodes; its fitness is its mean team return g.
        start = Start.draw(self.env, key_start, self.config.episodes)
        lived = self._rollout(state, start, key_rollout)
        evaluations = self.config.population * self.config.episodes
        team_returns = lived.team_return(self.config.fitness_discount)[:evaluations]
        fitness = team_returns.reshape(self.config.population, -1).mean(1)
        experience = self._buffer.add(state.experience, *transitions_of(lived))

        # Lines 10 to 15: rank, elites, tournament, crossover, mutation.
        evolution = next_generation(key_evolution, state.evolution, fitness, self.config.evolution)

        # Lines 16 to 22: each skill learns on its local reward, unless its return stopped improving.
        generation = state.generation + 1
        returns = self._skill_returns(lived.worlds(slice(evaluations, None)))
        plateau = state.plateau.observe(returns, generation, self.config.plateau)
        learners, losses = train_skills(
            key_skills,
            self._learner,
            state.learners,
            plateau.stopped,
            self._buffer,
            experience,
            self.config.updates,
            self.config.task_ends_skills,
        )
        state = MADySState(
            key,
            evolution,
            learners,
            plateau,
            experience,
            generation,
            state.environment_steps + lived.steps_lived(),
        )
        return state, self._metrics(state, fitness, returns, losses)

    def team(self, state: MADySState) -> SkillTeam:
        """The champion of the population, with the skills in use now."""
        return SkillTeam(self._codec.decode(state.evolution.champion()), skills_in_use(state))

    def transient_bytes(self) -> int:
        """Trajectories, their transitions as rows, and one more copy while both are made."""
        return 3 * 4 * self._transitions_per_generation() * self._buffer.width

    def _rollout(self, state: MADySState, start: Start, key: Key[Array, ""]) -> Trajectories:
        """Algorithm 2 for all teams at once and, in the worlds after theirs, each skill on its own."""
        config, n_skills, skills = self.config, len(self._skill_indices), skills_in_use(state)
        selectors = jax.vmap(self._codec.decode)(state.evolution.genomes)
        of_teams = stacked_policy(lambda chosen: SkillTeam(chosen, skills), selectors, config.population)
        of_probes = stacked_policy(
            lambda skill: FixedChoiceTeam(skill, skills, self.env.n_agents),
            jnp.arange(n_skills, dtype=jnp.int32),
            n_skills,
        )
        policy = side_by_side(of_teams, of_probes, config.population * config.episodes)
        worlds = start.repeat(config.population).join(start.first(config.probe_episodes).repeat(n_skills))
        # Noise is there for the skills to learn from; once all have stopped it would only blur fitness.
        noise = jnp.where(state.plateau.stopped.all(), 0.0, config.exploration_noise)
        lived = rollout(self.env, policy, ((), ()), worlds, key, noise)
        if self._skill_indices == tuple(range(len(self.env.skills))):
            return lived
        return dataclasses.replace(
            lived, local_rewards=lived.local_rewards[..., jnp.asarray(self._skill_indices)]
        )

    def _skill_returns(self, probes: Trajectories) -> Float[Array, " skills"]:
        """R_k of each skill, over its own probe episodes and all agents."""
        n_skills = len(self._skill_indices)

        def of_skill(skill, rewards, lived):
            lived = jnp.broadcast_to(lived[..., None], rewards.shape[:-1])
            return mean_return(rewards[..., skill], lived, self.config.learner.discount)

        by_skill = jax.tree.map(
            lambda leaf: leaf.reshape(leaf.shape[0], n_skills, -1, *leaf.shape[2:]),
            (probes.local_rewards, probes.lived),
        )
        return jax.vmap(of_skill, in_axes=(0, 1, 1))(jnp.arange(n_skills), *by_skill)

    def _metrics(
        self, state: MADySState, fitness: Array, returns: Array, losses: dict[str, Array]
    ) -> dict[str, Array]:
        metrics = {
            "environment_steps": state.environment_steps,
            "fitness_best": fitness.max(),
            "fitness_mean": fitness.mean(),
            "champion_fitness": state.evolution.lineage.mean[0],
            "transitions_held": self._buffer.size(state.experience),
        }
        for index, name in enumerate(self.choices()):
            metrics[f"return_{name}"] = returns[index]
            metrics[f"stopped_at_{name}"] = state.plateau.stopped_at[index]
            for loss, values in losses.items():
                metrics[f"{loss}_{name}"] = values[index]
        return metrics

    def _create_selector(self, key: Key[Array, ""]) -> Selector:
        return Selector.create(key, self.env.observation_size, len(self._skill_indices), self.config.selector)

    def _transitions_per_generation(self) -> int:
        config = self.config
        worlds = config.population * config.episodes + len(self._skill_indices) * config.probe_episodes
        return worlds * self.env.episode_length * self.env.n_agents
