"""CCEA: a cooperative coevolutionary algorithm (thesis, section 2.1.9; Potter and De Jong 2000)."""

import dataclasses

from skillcrew.algorithms.ea import EA, EAConfig
from skillcrew.algorithms.team_search import EvolverName


@dataclasses.dataclass(frozen=True)
class CCEAConfig(EAConfig):
    """Options of CCEA: those of EA, with other defaults."""

    evolver: EvolverName = "coevolution"
    """What the next generation is made by; see `SearchConfig`."""


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
