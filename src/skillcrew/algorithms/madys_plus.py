"""MADyS in our best form: selectors that commit to phases and may react to what they sense."""

import dataclasses

from skillcrew.algorithms.madys import MADyS, MADySConfig
from skillcrew.evolution.genetic import EvolutionConfig
from skillcrew.evolution.restart import RestartConfig
from skillcrew.policies.selector import SelectorConfig


@dataclasses.dataclass(frozen=True)
class MADySPlusConfig(MADySConfig):
    """Options of MADyS, with other defaults."""

    population: int = 100
    """Teams."""
    episodes: int = 4
    """Evaluation episodes per team and generation."""
    fitness_discount: float = 1.0
    """Discount per step of the team reward in a team's fitness; see `SearchConfig`. Below 1, of two teams the
    quicker one wins although it succeeds less often."""
    evolution: EvolutionConfig = dataclasses.field(
        default_factory=lambda: EvolutionConfig(elites=10, challengers=20, restart=RestartConfig(patience=40))
    )
    """How the genetic algorithm breeds. Where it is stuck it begins anew: unready skills can mislead it."""
    selector: SelectorConfig = dataclasses.field(
        default_factory=lambda: SelectorConfig(hidden=(), phases=12, reactive=True, alike=0.5)
    )
    """A timetable for each agent, and a linear map of what it senses that may intervene. Half of the first
    teams are of one mind, the others of several."""
    recorded_episodes: int | None = 1
    """Episodes of each team and generation that enter the buffer: there are more teams than skills need."""
    updates: int = 200
    """Critic updates per skill and generation; a generation is longer than the default's."""


class MADySPlus(MADyS):
    """MADyS in our best form: a timetable for each agent, which may react to what it senses.

    The same step as MADyS, on the same rewards; other defaults.
    """

    name = "madys-plus"
    label = "MADyS+"
    config_class = MADySPlusConfig
