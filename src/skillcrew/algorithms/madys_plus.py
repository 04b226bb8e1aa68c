"""MADyS in our best form: selectors that commit to phases and may react to what they sense."""

import dataclasses

from skillcrew.algorithms.madys import MADyS, MADySConfig
from skillcrew.algorithms.skill_learning import SkillConfig
from skillcrew.evolution.genetic import EvolutionConfig
from skillcrew.evolution.restart import RestartConfig
from skillcrew.learners.plateau import PlateauConfig
from skillcrew.learners.td3 import TD3Config
from skillcrew.policies.selector import SelectorConfig


@dataclasses.dataclass(frozen=True)
class MADySPlusConfig(MADySConfig):
    """Options of MADyS, with other defaults."""

    population: int = 100
    """Teams."""
    episodes: int = 2
    """Evaluation episodes per team and generation. Fewer are a lottery, more find a solution later."""
    probe_episodes: int = 2
    """Episodes per skill and generation in which all agents use that skill alone; see `SkillConfig`."""
    fitness_discount: float = 1.0
    """Discount per step of the team reward in a team's fitness; see `SearchConfig`. Below 1, of two teams the
    quicker one wins although it succeeds less often."""
    evolution: EvolutionConfig = dataclasses.field(
        default_factory=lambda: EvolutionConfig(
            elites=10, veterans=3, level_memory=20.0, challengers=20, restart=RestartConfig(patience=40)
        )
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
    """Critic updates per skill and generation: steps are mostly spent while skills learn."""
    learner: TD3Config = dataclasses.field(
        default_factory=lambda: dataclasses.replace(SkillConfig().learner, batch_size=128)
    )
    """How skills learn: as MADyS's, from mini-batches of half the size, for half the time."""
    plateau: PlateauConfig = dataclasses.field(
        default_factory=lambda: PlateauConfig(window=20, smoothing=0.9)
    )
    """When a skill stops learning: MADyS's generations twice over, for each has half of the experience."""


class MADySPlus(MADyS):
    """MADyS in our best form: a timetable for each agent, which may react to what it senses.

    The same step as MADyS, on the same rewards; other defaults.
    """

    name = "madys-plus"
    label = "MADyS+"
    config_class = MADySPlusConfig
