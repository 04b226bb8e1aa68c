"""The Rover Domain's named configurations."""

from skillcrew.envs.rover.config import RoverConfig, TeamReward
from skillcrew.envs.rover.crew import RoverType

_AB_THEN_CD = (("A", "B"), ("C", "D"))


def _crew(scouts: int, haulers: int, scouts_at_poi: int) -> tuple[RoverType, ...]:
    """Fast scouts with a fine sensor, and haulers that turn and drive slowly and do not see as far."""
    return (
        RoverType("scout", scouts, coupling=scouts_at_poi, max_speed=1.5, sensor_resolution=45),
        RoverType("hauler", haulers, coupling=1, max_turn=1.5, max_speed=0.75, observation_radius=20.0),
    )


def _dense(coupling: int, team_reward: TeamReward) -> RoverConfig:
    """Six rovers and four POIs that are all alike."""
    return RoverConfig(
        n_agents=6,
        n_poi_types=1,
        pois_per_type=4,
        spatial_coupling=coupling,
        episode_length=50,
        team_reward=team_reward,
    )


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
    # Rovers of two types, of which a POI takes both.
    "rover-t2-crew": RoverConfig(n_poi_types=2, episode_length=50, rover_types=_crew(2, 1, 1)),
    "rover-t3-crew": RoverConfig(n_poi_types=3, episode_length=60, rover_types=_crew(4, 2, 2)),
    # Dense ground, for which gradient methods were made: no order, and each of four POIs pays.
    "rover-p4-c1-value": _dense(coupling=1, team_reward="value"),
    "rover-p4-c3-value": _dense(coupling=3, team_reward="value"),
    "rover-p4-c1-closest": _dense(coupling=1, team_reward="closest"),
    "rover-p4-c3-closest": _dense(coupling=3, team_reward="closest"),
}
"""By name. docs/environments/rover.md says what each is for."""
