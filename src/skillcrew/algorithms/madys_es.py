"""MADyS with one remembering selector for the whole team, moved by an evolution strategy."""

import dataclasses
from typing import Literal

from skillcrew.algorithms.madys import MADyS, MADySConfig
from skillcrew.algorithms.team_search import EvolverName
from skillcrew.policies.selector import SelectorConfig


@dataclasses.dataclass(frozen=True)
class MADySESConfig(MADySConfig):
    """Options of MADyS, with other defaults."""

    population: int = 128
    """Teams."""
    episodes: int = 10
    """Evaluation episodes per team and generation."""
    episodes_shared_by: Literal["population", "pair"] = "pair"
    """Who meets the same episodes; see `SearchConfig`. "pair" keeps a search from one team that does half of
    the task."""
    evolver: EvolverName = "strategy"
    """What the next generation is made by. Every episode moves the one mean a little, where breeding favours
    the lucky."""
    selector: SelectorConfig = dataclasses.field(
        default_factory=lambda: SelectorConfig(memory=16, sharing="team")
    )
    """One selector with memory for all agents: a memoryless one can only guess which POIs are done."""
    recorded_episodes: int | None = 1
    """Episodes of each team and generation that enter the buffer: there are more teams than skills need."""
    updates: int = 200
    """Critic updates per skill and generation; a generation is six times as long as the default's."""


class MADySES(MADyS):
    """The first MADyS+: one selector with memory for the whole team, moved by an evolution strategy.

    The same step as MADyS, on the same rewards; other defaults.
    """

    name = "madys-es"
    label = "MADyS-ES"
    config_class = MADySESConfig
