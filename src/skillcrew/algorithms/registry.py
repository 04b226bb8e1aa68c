"""The algorithms by the names that the command line uses; each is imported when it is asked for."""

import dataclasses
import importlib
from typing import TYPE_CHECKING, Any

from skillcrew.errors import unknown_name

if TYPE_CHECKING:
    from skillcrew.algorithms.algorithm import Algorithm
    from skillcrew.envs.environment import Environment


@dataclasses.dataclass(frozen=True)
class Listed:
    """An algorithm, and what is said of it before it is imported."""

    place: str
    """`module:Class`; the class has `name`, `config_class`, and is made from an environment and a
    configuration."""
    about: str
    """One line."""

    def load(self) -> Any:
        """Imports the class."""
        module, _, name = self.place.partition(":")
        return getattr(importlib.import_module(module), name)


def _ours(place: str, about: str) -> Listed:
    return Listed(f"skillcrew.algorithms.{place}", about)


ALGORITHMS: dict[str, Listed] = {
    "madys": _ours(
        "madys:MADyS",
        "Teams of selectors evolve on the team reward; shared skills learn by TD3 on local rewards.",
    ),
    "madys-plus": _ours(
        "madys_plus:MADySPlus",
        "MADyS in our best form: a timetable for each agent, which may react to what it senses.",
    ),
    "madys-es": _ours(
        "madys_es:MADySES",
        "The first MADyS+: one selector with memory for the whole team, moved by an evolution strategy.",
    ),
    "open-loop": _ours(
        "open_loop:OpenLoop",
        "MADyS+ with timetables alone: which skill is followed depends on the time, and on nothing else.",
    ),
    "mfl": _ours(
        "mfl:MFL",
        "Skills are trained first, on local rewards; then they are frozen, and teams of selectors evolve.",
    ),
    "ea": _ours(
        "ea:EA",
        "Teams of actors evolve on the team reward; nothing learns by gradient, and there are no skills.",
    ),
    "ccea": _ours(
        "ccea:CCEA",
        "Each agent has a subpopulation of actors of its own; teams are drawn across them.",
    ),
    "merl": _ours(
        "merl:MERL",
        "Teams of actors evolve on the team reward, and one that learns on local rewards joins them.",
    ),
    "erl": _ours(
        "erl:ERL",
        "A population of actors for the whole team evolves, and one that learns by gradient joins it.",
    ),
    "cerl": _ours(
        "cerl:CERL",
        "A population of actors for the whole team evolves, and a portfolio of learners joins it.",
    ),
    "td3": _ours(
        "independent:IndependentTD3",
        "Each agent learns by TD3 on a reward of its own or the team's; nothing evolves.",
    ),
    "ddpg": _ours(
        "independent:IndependentDDPG",
        "Each agent learns by DDPG on a reward of its own or the team's; nothing evolves.",
    ),
    "dqn": _ours(
        "independent:IndependentDQN",
        "Each agent learns by DQN on a reward of its own or the team's; for discrete actions.",
    ),
    "maddpg": _ours(
        "maddpg:MADDPG",
        "Each agent's actor learns from a critic that sees all agents; nothing evolves.",
    ),
    "matd3": _ours(
        "maddpg:MATD3",
        "MADDPG with twin critics, actors that wait for them, and noise on target actions.",
    ),
    "ippo": _ours(
        "ppo:IPPO",
        "Each agent learns by PPO from what it sees itself: actions, or which skill to use.",
    ),
    "mappo": _ours(
        "ppo:MAPPO",
        "Agents learn by PPO with critics that see what all of them see: actions, or which skill to use.",
    ),
    "coma": _ours(
        "coma:COMA",
        "Agents learn by policy gradient from what each one's choice changed; of skills or discrete actions.",
    ),
    "liir": _ours(
        "liir:LIIR",
        "Agents learn by policy gradient, each also on a reward that is learned for it.",
    ),
}
"""In the order in which they are listed."""


def algorithm_class(name: str) -> Any:
    """The algorithm called `name`.

    Raises:
        UserError: no algorithm of that name; the message lists the valid ones, nearest first.
    """
    if name not in ALGORITHMS:
        raise unknown_name("algorithm", name, ALGORITHMS)
    return ALGORITHMS[name].load()


def make_algorithm(name: str, env: "Environment", config: Any = None) -> "Algorithm":
    """Makes an algorithm for an environment; `config` defaults to the measured values."""
    return algorithm_class(name)(env, config)
