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
    """Who meets the same episodes; see `SearchConfig`. Of four seeds of rover-t2-c1, one or two stayed at the
    success of a team that only ever goes to B (0.1) where all teams met the same ten episodes, also with
    twice to four times the deviation and larger steps; none where each pair met its own and stalled
    searches began anew."""
    evolver: EvolverName = "strategy"
    """What the next generation is made by. Where one success in fifty episodes is all there is at first, as
    in rover-t3-c3, a genetic algorithm breeds the lucky; here every episode moves the one mean a little."""
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
