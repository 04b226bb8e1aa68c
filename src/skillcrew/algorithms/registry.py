"""The algorithms by the names that the command line uses."""

from typing import Any

from skillcrew.algorithms.algorithm import Algorithm
from skillcrew.algorithms.ccea import CCEA
from skillcrew.algorithms.cerl import CERL
from skillcrew.algorithms.ea import EA
from skillcrew.algorithms.erl import ERL
from skillcrew.algorithms.independent import IndependentDDPG, IndependentTD3
from skillcrew.algorithms.madys import MADyS
from skillcrew.algorithms.madys_es import MADySES
from skillcrew.algorithms.madys_plus import MADySPlus
from skillcrew.algorithms.merl import MERL
from skillcrew.algorithms.mfl import MFL
from skillcrew.algorithms.open_loop import OpenLoop
from skillcrew.envs.environment import Environment
from skillcrew.errors import unknown_name

ALGORITHMS: dict[str, Any] = {
    kind.name: kind
    for kind in (
        *(MADyS, MADySPlus, MADySES, OpenLoop, MFL),
        *(EA, CCEA, MERL, ERL, CERL, IndependentTD3, IndependentDDPG),
    )
}
"""Each class has `name`, `config_class`, and is made from an environment and a configuration."""


def algorithm_class(name: str) -> Any:
    """The algorithm called `name`.

    Raises:
        UserError: no algorithm of that name; the message lists the valid ones, nearest first.
    """
    if name not in ALGORITHMS:
        raise unknown_name("algorithm", name, ALGORITHMS)
    return ALGORITHMS[name]


def make_algorithm(name: str, env: Environment, config: Any = None) -> Algorithm:
    """Makes an algorithm for an environment; `config` defaults to the measured values."""
    return algorithm_class(name)(env, config)
