"""The open-loop baseline: MADyS+ whose teams sense nothing. What looking is worth is measured from it."""

import dataclasses

from skillcrew.algorithms.madys_plus import MADySPlus, MADySPlusConfig
from skillcrew.policies.selector import SelectorConfig


def _blind() -> SelectorConfig:
    return dataclasses.replace(MADySPlusConfig().selector, reactive=False)


@dataclasses.dataclass(frozen=True)
class OpenLoopConfig(MADySPlusConfig):
    """Options of MADyS+, with timetables alone."""

    selector: SelectorConfig = dataclasses.field(default_factory=_blind)
    """A timetable for each agent; with `sharing` "team", one for all of them."""


class OpenLoop(MADySPlus):
    """MADyS+ with timetables alone: which skill an agent follows depends on the time, and on nothing else."""

    name = "open-loop"
    label = "Open loop"
    config_class = OpenLoopConfig
