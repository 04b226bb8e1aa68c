"""What all figures share: their style, their layout, and how they are written.

Figures are built object by object: `pyplot` keeps every figure alive and chooses a window system,
neither of which a library may do to its user.
"""

import io
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from skillcrew.experiment.files import disk_errors, write_whole

STYLE: dict[Any, Any] = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 9,
    "axes.titlesize": 9,
    "axes.labelsize": 9,
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "figure.titlesize": 11,
    "legend.fontsize": 9,
    "legend.frameon": False,
    "xtick.labelsize": 8.5,
    "ytick.labelsize": 8.5,
    # TrueType and not Type 3 outlines: text in the file can be selected, searched and edited.
    "pdf.fonttype": 42,
}


def layout() -> ConstrainedLayoutEngine:
    """Keeps labels and legends from touching each other or the border (inches)."""
    return ConstrainedLayoutEngine(w_pad=0.08, h_pad=0.08)


def save(figure: Figure, stem: Path) -> list[Path]:
    """Writes `<stem>.png` (150 dots per inch) and `<stem>.pdf`; equal figures give equal bytes.

    Each file appears complete or not at all: a reader meanwhile sees the old one or the new one.

    Args:
        figure: what to write.
        stem: the path without the suffixes, which are added to whatever it is ("fig-4.2" too);
            missing folders are made.

    Returns:
        The two paths, PNG first.

    Raises:
        UserError: the folder cannot be written to.
    """
    # Dates and matplotlib's version would make every rewrite a new file to git and to caches.
    metadata: dict[str, dict[str, None]] = {
        "png": {"Software": None},
        "pdf": {"Creator": None, "Producer": None, "CreationDate": None},
    }
    return [
        _save_one(figure, stem.with_name(f"{stem.name}.{kind}"), kind, metadata[kind]) for kind in metadata
    ]


def _save_one(figure: Figure, path: Path, kind: str, metadata: dict[str, None]) -> Path:
    """Draws in memory, then writes: on a full disk matplotlib fails in ways of its own."""
    drawn = io.BytesIO()
    with matplotlib.rc_context(STYLE):
        figure.savefig(drawn, format=kind, dpi=150, metadata=metadata)
    with disk_errors(path):
        path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, lambda partial: partial.write_bytes(drawn.getvalue()))
    return path
