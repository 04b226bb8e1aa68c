"""The warehouse's named configurations."""

from skillcrew.envs.warehouse.config import WarehouseConfig

PRESETS: dict[str, WarehouseConfig] = {
    "warehouse-o1-c2": WarehouseConfig(n_agents=2, n_orders=1, coupling=2, episode_length=40),
    "warehouse-o2-c2": WarehouseConfig(n_agents=4, n_orders=2, coupling=2, episode_length=55),
    "warehouse-o3-c3": WarehouseConfig(
        n_agents=6, n_orders=3, coupling=3, episode_length=80, latest_order=20
    ),
}
"""By name. docs/environments/warehouse.md says what each is for."""
