"""Which run another one began with, as its configuration says it."""

import dataclasses
from pathlib import Path
from typing import ClassVar

from skillcrew.errors import UserError, one_line
from skillcrew.experiment.progress import human


@dataclasses.dataclass(frozen=True)
class Origin:
    """A run whose skills or team another run begins with; all but the folder is known once it begins."""

    __pydantic_config__: ClassVar[dict[str, str]] = {"extra": "forbid"}

    run: str
    """Its folder."""
    checkpoint: int | None = None
    """The generation whose checkpoint is read. Default: the latest."""
    digest: str | None = None
    """Of that checkpoint."""
    steps: int | None = None
    """Environment steps per seed that it had cost, those of the runs that it began with included."""

    def __post_init__(self) -> None:
        if not self.run:
            raise UserError("a run to begin with has no name; give its folder")

    @classmethod
    def of(cls, given: "Path | str | Origin | None") -> "Origin | None":
        """Of a folder, or of what is one already."""
        return given if given is None or isinstance(given, cls) else cls(str(given))


def sayings(skills_from: Origin | None, team_from: Origin | None, frozen: bool) -> list[str]:
    """What a run began with and what that had cost, a line for each; empty if with nothing."""
    if skills_from == team_from:
        parts = [("skills and team", skills_from)]
    else:
        parts = [("skills", skills_from), ("team", team_from)]
    return [
        f"began with {what} of {one_line(origin.run)}{_cost(origin)}"
        + ("; these skills learn no more" if frozen and origin == skills_from else "")
        for what, origin in parts
        if origin is not None
    ]


def _cost(origin: Origin) -> str:
    if origin.steps is None:
        return ""
    cost = f"{human(origin.steps)} steps per seed"
    return f" (generation {origin.checkpoint}), which had cost {cost} that are not counted here"
