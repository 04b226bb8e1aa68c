"""MADyS in our best form: one remembering selector for the whole team, moved by an evolution strategy."""

import dataclasses
from typing import Literal

from skillcrew.algorithms.madys import MADyS, MADySConfig
from skillcrew.policies.memory import PolicyConfig


@dataclasses.dataclass(frozen=True)
class MADySPlusConfig(MADySConfig):
    """Options of MADyS, with other defaults."""

    population: int = 128
    """Teams."""
    episodes: int = 10
    """Evaluation episodes per team and generation; all teams meet the same ones."""
    episodes_shared_by: Literal["population", "pair"] = "pair"
    evolver: Literal["genetic", "strategy"] = "strategy"
    selector: PolicyConfig = dataclasses.field(
        default_factory=lambda: PolicyConfig(memory=16, sharing="team")
    )
    recorded_episodes: int | None = 1
    updates: int = 200


class MADySPlus(MADyS):
    """MADyS in our best form: one selector with memory for the whole team, moved by an evolution strategy.

    The same step as MADyS, on the same rewards; other defaults.
    """

    name = "madys-plus"
    config_class = MADySPlusConfig
