"""Learning curves as plain values: a panel for each environment and kind of score."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from jaxtyping import Real

from skillcrew.analysis.curves import Curve
from skillcrew.analysis.page.packing import short
from skillcrew.analysis.statistics import Band
from skillcrew.experiment.score import Score

MOST_ROWS = 400
"""Of a single seed's curve; more than a chart has room for."""


@dataclasses.dataclass(frozen=True)
class Curves:
    """A curve for either axis of steps."""

    even: Curve
    logarithmic: Curve
    """The same, with its band even on a logarithmic axis."""


@dataclasses.dataclass(frozen=True)
class Line:
    """One entry of a panel."""

    environment: str
    name: str
    """Tells it from the others of its panel."""
    curves: Curves


def panels(
    lines: Mapping[int, Line], pooled: Sequence[tuple[tuple[int, ...], Line]] = ()
) -> list[dict[str, Any]]:
    """All panels, ready for JSON.

    Args:
        lines: by the place of their run among all.
        pooled: curves over several runs, with the places of these.
    """
    found: dict[tuple[str, str], dict[str, Any]] = {}
    for index, line in lines.items():
        score = line.curves.even.score
        fresh = {"environment": line.environment, "score": describe_score(score), "curves": [], "pooled": []}
        panel = found.setdefault((line.environment, score.key), fresh)
        panel["curves"].append({"run": index, **_curve(line)})
    for runs, line in pooled:
        panel = found[line.environment, line.curves.even.score.key]
        panel["pooled"].append({"runs": list(runs), **_curve(line)})
    return list(found.values())


def describe_score(score: Score) -> dict[str, Any]:
    """What axes and numbers need to know of it."""
    ends = [score.lower, score.upper] if score.bounded else None
    return {"label": score.label, "word": score.word, "ends": ends, "decimals": score.decimals}


def _curve(line: Line) -> dict[str, Any]:
    curve, logarithmic = line.curves.even, line.curves.logarithmic
    rows = [thinned(steps, values) for steps, values in curve.per_seed]
    return {
        "label": line.name,
        "band": _band(curve.band),
        "logarithmic": _band(logarithmic.band),
        "seeds": [{"steps": short(steps, 6), "values": short(values)} for steps, values in rows],
        "pretrained": None if curve.pretrained_at is None else float(curve.pretrained_at),
    }


def _band(band: Band) -> dict[str, Any]:
    return {
        "steps": short(band.steps, 6),
        "mean": short(band.mean),
        "low": short(band.low),
        "high": short(band.high),
    }


def thinned(
    steps: Real[np.ndarray, " _"], values: Real[np.ndarray, " _"], most: int = MOST_ROWS
) -> tuple[Real[np.ndarray, " _"], Real[np.ndarray, " _"]]:
    """At most so many of the rows that hold a value, evenly, with the first and the last."""
    kept = np.flatnonzero(~np.isnan(np.asarray(values, float)))
    which = kept[np.unique(np.linspace(0, len(kept) - 1, min(len(kept), most)).round().astype(int))]
    return steps[which], values[which]
