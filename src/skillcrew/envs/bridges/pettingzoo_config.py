"""Options of a PettingZoo environment, known before PettingZoo is imported."""

import dataclasses

from skillcrew.envs.bridges.host_config import HostConfig
from skillcrew.errors import UserError


@dataclasses.dataclass(frozen=True)
class PettingZooConfig(HostConfig):
    """A PettingZoo environment; it is stepped on the host, which is slow."""

    module: str = "mpe2.simple_spread_v3"
    """The module whose `parallel_env` makes it."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not all(part.isidentifier() for part in self.module.split(".")):
            raise UserError(f"module = {self.module!r}: give a module, such as mpe2.simple_spread_v3")

    def imports(self) -> str:
        return self.module

    def called(self) -> str:
        return self.module.rpartition(".")[2]
