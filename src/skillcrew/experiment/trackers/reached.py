"""How far a tracker's record goes, as plain data in its folder."""

import dataclasses
import json
import re
import secrets
from pathlib import Path

from skillcrew.errors import UserError
from skillcrew.experiment.files import read_plain, write_whole

FILE = "recorded.json"


@dataclasses.dataclass(frozen=True)
class Reached:
    """What is in a record."""

    identity: str
    """Of the record, where its tracker keeps it elsewhere."""
    generation: int = 0
    """The last one whose rows are in it."""
    concluded: int = 0
    """The generation whose scores and figures are in it."""

    @classmethod
    def read(cls, folder: Path) -> "Reached":
        """Of a folder that a tracker wrote; a new one where there is none.

        Raises:
            UserError: the file is damaged, or somebody else's.
        """
        path = folder / FILE
        if not path.exists():
            return cls(secrets.token_hex(4))
        try:
            reached = cls(**json.loads(read_plain(path)))
            counts = (reached.generation, reached.concluded)
            if not (re.fullmatch("[0-9a-f]{8}", reached.identity) and all(type(n) is int for n in counts)):
                raise ValueError
        except (OSError, ValueError, TypeError, RecursionError) as error:
            raise UserError(f"{path}: damaged; delete {folder} to record anew") from error
        return reached

    def write(self, folder: Path) -> None:
        """Replaces the file at once."""
        text = json.dumps(dataclasses.asdict(self)) + "\n"
        write_whole(folder / FILE, lambda path: path.write_text(text))
