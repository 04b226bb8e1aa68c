"""The Rover Domain's named configurations."""

from skillcrew.envs.rover.config import RoverConfig

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
