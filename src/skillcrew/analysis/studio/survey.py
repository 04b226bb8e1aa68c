"""Which run folders there are below a folder, and which of their files are theirs to show."""

import hashlib
import os
from pathlib import Path

from skillcrew.errors import UserError

MOST_FOLDERS = 5000
"""That are looked into; a home directory has many more."""

MOST_RUNS = 1000

DEEPEST = 8
"""Levels below the folder; a comparison's runs are two below it."""


def find_runs(root: Path) -> tuple[dict[str, Path], bool]:
    """The run folders below a folder, or the folder itself if it is one.

    Hidden folders and links are left out, and so is what lies inside of a run.

    Returns:
        Them by a key that is short, stays the same, and can stand in an address; and whether some were left
        out because there are too many.
    """
    found: list[Path] = []
    waiting, looked_into = [(root, 0)], 0
    while waiting and looked_into < MOST_FOLDERS and len(found) < MOST_RUNS:
        folder, depth = waiting.pop(0)
        looked_into += 1
        try:
            with os.scandir(folder) as entries:
                inside = sorted(entries, key=lambda entry: entry.name)
        except OSError:
            # It has gone since, or is nobody's to read.
            continue
        if any(entry.name == "config.yaml" for entry in inside):
            found.append(folder)
        elif depth < DEEPEST:
            folders = [entry for entry in inside if entry.is_dir(follow_symlinks=False)]
            waiting += [(Path(entry.path), depth + 1) for entry in folders if not entry.name.startswith(".")]
    return {_key(path.relative_to(root)): path for path in found}, bool(waiting)


def _key(path: Path) -> str:
    return hashlib.sha256(os.fsencode(path)).hexdigest()[:16]


def check_own(path: Path, root: Path, most: int) -> None:
    """Refuses a file that is not to be shown; one that is not there passes.

    Args:
        root: the folder that the studio shows.
        most: bytes.

    Raises:
        UserError: it leads out of the folder, is no file, or is too large.
    """
    real, home = os.path.realpath(path), os.path.realpath(root)
    if os.path.commonpath([real, home]) != home:
        raise UserError(f"{path}: leads out of {root}, and is not followed")
    if not os.path.lexists(real):
        return
    if not os.path.isfile(real):
        raise UserError(f"{path}: is no file")
    if (size := os.path.getsize(real)) > most:
        raise UserError(f"{path}: too large to be looked at ({size / 2**20:.0f} MiB)")
