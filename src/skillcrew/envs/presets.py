"""The named environments, and `make`, which builds one with any field overridden."""

import dataclasses
from typing import Any

from skillcrew.envs.environment import Environment
from skillcrew.envs.rover.config import RoverConfig
from skillcrew.envs.rover.world import RoverDomain
from skillcrew.errors import unknown_name

_AB_THEN_CD = (("A", "B"), ("C", "D"))

PRESETS: dict[str, RoverConfig] = {
    # Without an order of types, the kind of task that MERL was published on (spatial coupling 3).
    "rover-t1-c3": RoverConfig(n_agents=6, n_poi_types=1, spatial_coupling=3, episode_length=50),
    # The six configurations of the thesis (Figures 4.2 and 4.3).
    "rover-t2-c1": RoverConfig(n_agents=1, n_poi_types=2, spatial_coupling=1, episode_length=50),
    "rover-t2-c2": RoverConfig(n_agents=2, n_poi_types=2, spatial_coupling=2, episode_length=50),
    "rover-t2-c3": RoverConfig(n_agents=6, n_poi_types=2, spatial_coupling=3, episode_length=50),
    "rover-t3-c1": RoverConfig(n_agents=1, n_poi_types=3, spatial_coupling=1, episode_length=70),
    "rover-t3-c2": RoverConfig(n_agents=4, n_poi_types=3, spatial_coupling=2, episode_length=70),
    "rover-t3-c3": RoverConfig(n_agents=6, n_poi_types=3, spatial_coupling=3, episode_length=70),
    # More types, with 25 steps for each.
    "rover-t4-c3": RoverConfig(n_agents=6, n_poi_types=4, spatial_coupling=3, episode_length=100),
    "rover-t5-c3": RoverConfig(n_agents=6, n_poi_types=5, spatial_coupling=3, episode_length=125),
    "rover-t6-c3": RoverConfig(n_agents=6, n_poi_types=6, spatial_coupling=3, episode_length=150),
    # More rovers, of which half must meet.
    "rover-t3-c6": RoverConfig(n_agents=12, n_poi_types=3, spatial_coupling=6, episode_length=70),
    "rover-t3-c12": RoverConfig(n_agents=24, n_poi_types=3, spatial_coupling=12, episode_length=70),
    # No time to lose.
    "rover-t2-c2-tight": RoverConfig(n_agents=2, n_poi_types=2, spatial_coupling=2, episode_length=20),
    "rover-t3-c3-tight": RoverConfig(n_agents=6, n_poi_types=3, spatial_coupling=3, episode_length=35),
    # A team that must split; that learns the order by looking; whose POIs do not wait; that loses a rover.
    "rover-t4-c3-simultaneous": RoverConfig(
        n_agents=6, n_poi_types=4, spatial_coupling=3, episode_length=60, simultaneous=_AB_THEN_CD
    ),
    "rover-t3-c3-drawn": RoverConfig(
        n_agents=6, n_poi_types=3, spatial_coupling=3, episode_length=30, order="drawn"
    ),
    "rover-t2-c2-moving": RoverConfig(
        n_agents=2, n_poi_types=2, spatial_coupling=2, episode_length=25, poi_speed=0.5
    ),
    "rover-t4-c3-breakdown": RoverConfig(
        n_agents=7,
        n_poi_types=4,
        spatial_coupling=3,
        episode_length=45,
        simultaneous=_AB_THEN_CD,
        breakdowns=1,
    ),
}
"""By name. docs/environments/rover.md says what each is for."""


def preset(name: str) -> RoverConfig:
    """The configuration called `name`.

    Raises:
        UserError: no preset of that name; the message lists the valid ones, nearest first.
    """
    if name not in PRESETS:
        raise unknown_name("environment preset", name, PRESETS)
    return PRESETS[name]


def make(name: str, **overrides: Any) -> Environment:
    """Makes the environment of a preset, with any field overridden.

    Args:
        name: a preset, such as "rover-t2-c2".
        overrides: fields of `RoverConfig`, such as `n_agents=4`.

    Raises:
        UserError: an unknown preset or field, or a value that the field refuses.
    """
    config = preset(name)
    fields = [field.name for field in dataclasses.fields(config)]
    for field in overrides:
        if field not in fields:
            raise unknown_name(f"field of {name}", field, fields)
    return make_configured(name, dataclasses.replace(config, **overrides))


def make_configured(name: str, config: RoverConfig) -> Environment:
    """Makes an environment with every field given.

    Args:
        name: the preset that it comes from.
    """
    return RoverDomain(config, name)
