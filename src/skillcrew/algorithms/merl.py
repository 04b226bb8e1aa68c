"""MERL: Multiagent Evolutionary Reinforcement Learning (Khadka et al. 2019; thesis, section 2.2.4).

Teams of actors evolve on the sparse team reward; one more team learns by gradient on each agent's dense
local reward, from what everybody lives; now and then it migrates into the population.
Team reward: evolution only. Local rewards: gradients only.
"""

import dataclasses
from typing import Any, Literal

from skillcrew.algorithms.actor_learning import ActorLearning
from skillcrew.algorithms.algorithm import agents_differ, override
from skillcrew.algorithms.migration import Migration, MigrationConfig, MigrationState, OneLearnerMigrates
from skillcrew.algorithms.skill_learning import SkillConfig
from skillcrew.envs.environment import Environment
from skillcrew.envs.identified import Identified
from skillcrew.envs.padded import uniform
from skillcrew.errors import UserError, unknown_name
from skillcrew.learners.dqn import DQNConfig
from skillcrew.learners.td3 import TD3Config
from skillcrew.policies.network import NetworkConfig
from skillcrew.policies.team import ActorTeam, IdentifiedTeam


@dataclasses.dataclass(frozen=True)
class MERLConfig(MigrationConfig):
    """Options of MERL."""

    sharing: Literal["trunk", "agent", "team"] = "trunk"
    """What agents share: "trunk" all but the actor's last layer (MERL), with one critic that is told
    whose action it judges; "agent" nothing, each learns from its own transitions; "team" everything."""
    reward: str = "first"
    """What each actor maximises: names of skills joined by +, "local" for all, "first" for the environment's
    first. The team's reward is refused: in MERL it is evolution's."""
    task_ends_value: bool = False
    """Whether an actor's value ends where the team's task is done; see `SkillConfig.task_ends_skills`."""
    learner_episodes: int = 10
    """Noisy episodes of the learning team per generation, each in a fresh world."""
    exploration_noise: float = 0.3
    """Standard deviation of the noise on primitive actions in them; as that of MADyS's skills."""
    learner: TD3Config = dataclasses.field(
        default_factory=lambda: dataclasses.replace(
            SkillConfig().learner, network=NetworkConfig(hidden=(32,))
        )
    )
    """How actors learn; by default as MADyS's skills do, whose rewards are the same. The network is also what
    evolves, and large ones evolve slowly."""
    dqn: DQNConfig = dataclasses.field(
        default_factory=lambda: dataclasses.replace(SkillConfig().dqn, network=NetworkConfig(hidden=(32,)))
    )
    """How they learn where actions are discrete."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.sharing not in ("trunk", "agent", "team"):
            raise unknown_name("sharing", str(self.sharing), ("trunk", "agent", "team"))
        if "team" in self.reward.split("+"):
            raise UserError(
                f"reward = {self.reward}: MERL's gradient never sees the team's reward, evolution does; give "
                "the name of a skill, or several joined by +"
            )
        if self.evolver == "coevolution" and self.sharing != "agent":
            raise UserError(
                "evolver = coevolution: each agent's own network has a subpopulation; set sharing to agent "
                f"(it is {self.sharing})"
            )


class MERL(OneLearnerMigrates):
    """Teams of actors evolve on the team reward, and one that learns on local rewards migrates into them.

    `MERL(env, reward="go_to_poi_A")` overrides fields of `MERLConfig`.

    Raises:
        UserError: an unknown field or reward, or a value that a field refuses.
    """

    name = "merl"
    label = "MERL"
    config_class = MERLConfig

    def __init__(self, env: Environment, config: MERLConfig | None = None, **overrides: Any):
        self.env = env
        self.config = override(self, config, overrides)
        if env.types and self.config.sharing == "team":
            raise agents_differ(env)
        own = self.config.sharing == "agent"
        heads = env.n_agents if self.config.sharing == "trunk" else 0
        told = Identified(uniform(env)) if heads else env
        actors = env.n_agents if own else 1
        first = self.config.reward == "first" and env.skills
        rewarded = dataclasses.replace(self.config, reward=_first(env)) if first else self.config
        learning = ActorLearning(told, rewarded, n_actors=actors, heads=heads)
        self._migration = Migration(told, self.config, learning, networks=actors, heads=heads)

    def team(self, state: MigrationState) -> ActorTeam | IdentifiedTeam:
        """The champion of the population."""
        champion = self._migration.champion(state)
        return IdentifiedTeam(champion) if self.config.sharing == "trunk" else champion


def _first(env: Environment) -> str:
    """The environment's first skill, or that of each type of agents."""
    firsts = [f"{kind.name}/{kind.skills[0]}" for kind in env.types if kind.skills]
    return "+".join(firsts) if env.types else env.skills[0]
