"""How far a run is and what it reached, from what its folder holds."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from skillcrew.errors import UserError
from skillcrew.experiment.files import read_plain
from skillcrew.experiment.metrics import Columns
from skillcrew.experiment.score import score_among


def progress(columns: Columns) -> list[dict[str, Any]]:
    """Of each seed: how far it is, and what its champion reached in the last generation."""
    score = score_among(columns)
    last = [np.flatnonzero(columns["seed"] == seed)[-1] for seed in dict.fromkeys(columns["seed"].tolist())]
    names = ("seed", "generation", "environment_steps")
    return [
        {**{name: int(columns[name][row]) for name in names}, score.key: float(columns[score.key][row])}
        for row in last
    ]


def final_scores(path: Path) -> dict[str, Any] | None:
    """The final scores; None before there are any.

    Raises:
        UserError: damaged.
    """
    if not path.is_file():
        return None
    try:
        scores = json.loads(read_plain(path))
        reached = scores[score_among(scores).key]
        ends = [reached[end] for end in ("low", "high")]
        if not all(isinstance(number, int | float) for number in (scores["episodes"], reached["mean"])):
            raise ValueError
        if not all(end is None or isinstance(end, int | float) for end in ends):
            raise ValueError
    except (OSError, ValueError, RecursionError, KeyError, TypeError):
        raise UserError(f"{path}: damaged; `skillcrew report` writes it anew") from None
    return scores
