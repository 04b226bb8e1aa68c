"""Search and rescue's named configurations."""

from skillcrew.envs.rescue.config import RescueConfig

PRESETS: dict[str, RescueConfig] = {
    "rescue-v1-c2": RescueConfig(n_agents=3, n_victims=1, coupling=2, episode_length=50),
    "rescue-v2-c2": RescueConfig(n_agents=4, n_victims=2, coupling=2, episode_length=55),
    "rescue-v3-c3": RescueConfig(n_agents=6, n_victims=3, coupling=3, episode_length=70),
}
"""By name. docs/environments/rescue.md says what each is for."""
