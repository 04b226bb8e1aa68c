"""Options of a Gymnasium environment, known before Gymnasium is imported."""

import dataclasses

from skillcrew.envs.bridges.host_config import HostConfig
from skillcrew.errors import UserError


@dataclasses.dataclass(frozen=True)
class GymnasiumConfig(HostConfig):
    """A Gymnasium environment; it is stepped on the host, which is slow."""

    id: str = "Pendulum-v1"
    """What `gymnasium.make` is given; `module:id` imports a module that registers it."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.id.rpartition(":")[2]:
            raise UserError(f"id = {self.id!r}: give what gymnasium.make is given, such as Pendulum-v1")

    def imports(self) -> str:
        return self.id.rpartition(":")[0]

    def called(self) -> str:
        return self.id.rpartition(":")[2].replace("/", "-")
