"""Other projects' repositories, whose programs are measured as they lie there."""

import functools
import subprocess
from pathlib import Path


def commit(checkout: Path, folder: str) -> str:
    """Which version it is.

    Args:
        folder: where the programs are.

    Raises:
        SystemExit: they are not as they were committed, or it is no checkout.
    """
    git = functools.partial(subprocess.run, cwd=checkout, capture_output=True, text=True)
    head = git(["git", "rev-parse", "HEAD"])
    changes = git(["git", "status", "--porcelain", folder])
    if head.returncode or changes.returncode:
        raise SystemExit(f"{checkout}: {head.stderr or changes.stderr}")
    if changes.stdout:
        raise SystemExit(f"{checkout}: {folder} was changed:\n{changes.stdout}")
    return head.stdout.strip()
