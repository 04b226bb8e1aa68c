"""Environments of other libraries, by name."""

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any


@dataclasses.dataclass(frozen=True)
class Bridge:
    """Environments of another library, by a prefix and the name that they have there."""

    place: str
    """`module:Class` of ours that steps them."""
    configure: Callable[[str], Any]
    """The configuration, which says what it is `called()` and which `foreign_code()` it runs, for a name."""
    about: str
    """One line for lists."""


def _pettingzoo(name: str) -> Any:
    from skillcrew.envs.bridges.pettingzoo_config import PettingZooConfig

    return PettingZooConfig(module=name)


def _gymnasium(name: str) -> Any:
    from skillcrew.envs.bridges.gymnasium_config import GymnasiumConfig

    return GymnasiumConfig(id=name)


def _jaxmarl(name: str) -> Any:
    from skillcrew.envs.bridges.jaxmarl_config import JaxMARLConfig

    return JaxMARLConfig(env_id=name)


BRIDGES: Mapping[str, Bridge] = {
    "jaxmarl": Bridge(
        "skillcrew.envs.bridges.jaxmarl_in:JaxMARLEnvironment",
        _jaxmarl,
        "JaxMARL's worlds, such as jaxmarl:MPE_simple_spread_v3",
    ),
    "pettingzoo": Bridge(
        "skillcrew.envs.bridges.pettingzoo_world:PettingZooEnvironment",
        _pettingzoo,
        "PettingZoo's parallel worlds, such as pettingzoo:mpe2.simple_spread_v3; stepped in Python: slow",
    ),
    "gymnasium": Bridge(
        "skillcrew.envs.bridges.gymnasium_world:GymnasiumEnvironment",
        _gymnasium,
        "Gymnasium's worlds, teams of one, such as gymnasium:Pendulum-v1; stepped in Python: slow",
    ),
}
"""Other libraries' environments are called `prefix:name`."""
