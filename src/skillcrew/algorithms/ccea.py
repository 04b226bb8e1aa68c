"""CCEA: a cooperative coevolutionary algorithm (thesis, section 2.1.9; Potter and De Jong 2000)."""

import dataclasses

from skillcrew.algorithms.ea import EA, EAConfig
from skillcrew.algorithms.team_search import EvolverName
from skillcrew.credit.difference import CREDITS, credited
from skillcrew.envs.environment import Environment
from skillcrew.errors import UserError, unknown_name


@dataclasses.dataclass(frozen=True)
class CCEAConfig(EAConfig):
    """Options of CCEA: those of EA, with other defaults."""

    evolver: EvolverName = "coevolution"
    """What the next generation is made by; see `SearchConfig`."""
    reward: str = "team"
    """What individuals are bred for: "team", or "D" or "D++", their agent's own part of the team's reward
    (docs/algorithms/difference-rewards.md)."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.reward not in ("team", *CREDITS):
            raise unknown_name("reward", self.reward, ("team", *CREDITS))
        if self.reward == "team":
            return
        if self.evolver != "coevolution":
            raise UserError(
                f"reward = {self.reward}: credits agents, and evolver = {self.evolver} breeds whole teams; "
                "set evolver to coevolution or reward to team"
            )
        if self.race.finalists:
            raise UserError(
                f"race.finalists = {self.race.finalists}: a race is one of teams, and reward = "
                f"{self.reward} is an agent's; set race.finalists to 0"
            )


class CCEA(EA):
    """Each agent has a subpopulation of actors of its own; teams are drawn across them for the team reward.

    The generation is EA's; who plays with whom, leniency and the hall of fame are fields of
    `CoevolutionConfig`. `CCEA(env, population=60)` overrides fields of `CCEAConfig`.

    Raises:
        UserError: an unknown field, or a value that a field refuses.
    """

    name = "ccea"
    label = "CCEA"
    config_class = CCEAConfig
    config: CCEAConfig

    def _lived_in(self) -> Environment:
        return credited(self.env, self.config.reward)
