"""The page as a file."""

from collections.abc import Sequence
from pathlib import Path

from skillcrew.analysis.page.assemble import assemble
from skillcrew.analysis.page.contents import Pooled, RunContents, describe
from skillcrew.experiment.files import disk_errors, write_whole


def write_page(runs: Sequence[RunContents], pooled: Sequence[Pooled], title: str, path: Path) -> Path:
    """Writes one HTML file that shows some runs and opens anywhere, also without a network.

    Args:
        runs: at least one.
        pooled: curves over several of them.

    Returns:
        `path`.

    Raises:
        UserError: it cannot be written.
    """
    page = assemble(describe(runs, pooled, title), title)
    with disk_errors(path):
        path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, lambda temporary: temporary.write_text(page, encoding="utf-8"))
    return path
