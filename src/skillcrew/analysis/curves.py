"""Learning curves, alone and beside each other, as in Figures 4.2 and 4.3 of the thesis."""

import dataclasses
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib
import numpy as np
from jaxtyping import Real
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FixedLocator, FuncFormatter, NullFormatter

from skillcrew.analysis.canvas import STYLE, layout
from skillcrew.analysis.statistics import Band
from skillcrew.errors import UserError
from skillcrew.experiment.score import SUCCESS, Score

CURVE_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#AA4499", "#E69F00", "#56B4E9", "#333333")
"""Okabe and Ito's colours (with a stronger purple), which colour-blind readers tell apart."""

GRID = "#E6E6E6"

UNITS = ((1e9, " G"), (1e6, " M"), (1e3, " k"))
"""Of environment steps, the largest first."""


@dataclass(frozen=True, eq=False)
class Curve:
    """One line of a comparison: an algorithm in one environment, over its seeds."""

    label: str
    band: Band
    """The mean over seeds with its interval."""
    per_seed: Sequence[tuple[Real[np.ndarray, " _"], Real[np.ndarray, " _"]]]
    """For each seed its environment steps and values; rows with NaN are skipped."""
    pretrained_at: float | int | None = None
    """Environment steps after which pre-training ended (MFL); marked by a dotted line."""
    score: Score = SUCCESS
    """What its values are; the same for all curves of a panel."""


def learning_curves(curves: Sequence[Curve], title: str) -> Figure:
    """Scores over environment steps: each seed faint, the mean bold, its 95 % band shaded.

    Args:
        curves: at least one; colours repeat after seven, with other dashes.
        title: stands above the axes.

    Raises:
        UserError: no curves.
    """
    if not curves:
        raise UserError("there are no learning curves to draw")
    with matplotlib.rc_context(STYLE):
        # Each entry of the legend takes its own height and none from the axes.
        figure = Figure(figsize=(6.4, 3.9 + 0.2 * len(curves)), layout=layout())
        axes = figure.subplots()
        handles = _draw_panel(axes, curves, range(len(curves)))
        _linear_steps(axes, curves)
        axes.set_title(title, fontsize=11)
        figure.legend(handles, [_curve_name(curve) for curve in curves], loc="outside lower center")
    return figure


def panels_of_curves(panels: Mapping[str, Sequence[Curve]], title: str) -> Figure:
    """Several comparisons side by side, each in a panel of its own, with one legend.

    Steps are logarithmic: of methods that need 0.3 M and 6 M of them, a linear axis squeezes the first into
    its edge.

    Args:
        panels: by the title of each panel; a label has one colour in all of them. Means and bands alone are
            drawn, no single seeds. Panels share their axis of scores if that has bounds.
        title: stands above all panels.
    """
    with matplotlib.rc_context(STYLE):
        # Two entries fit under a panel, and each row of them takes its own height and none from the axes.
        labels = list(dict.fromkeys(curve.label for curves in panels.values() for curve in curves))
        rows = math.ceil((len(labels) + 1) / (2 * len(panels)))
        figure = Figure(figsize=(1.0 + 3.1 * len(panels), 3.5 + 0.2 * rows), layout=layout())
        shared = all(curve.score.bounded for curves in panels.values() for curve in curves)
        handles: dict[str, Any] = {}
        row = figure.subplots(1, len(panels), sharey=shared, squeeze=False)[0]
        for axes, (name, curves) in zip(row, panels.items(), strict=True):
            bare = [dataclasses.replace(curve, per_seed=[]) for curve in curves]
            own = [curve.label for curve in curves]
            handles |= dict(zip(own, _draw_panel(axes, bare, map(labels.index, own)), strict=True))
            _logarithmic_steps(axes, bare)
            axes.set_title(name)
            if axes is not row[0]:
                axes.set_ylabel("")
        entries = [(handles[label], label) for label in labels]
        pretrained = [curve for curves in panels.values() for curve in curves if curve.pretrained_at]
        if pretrained:
            dotted = Line2D([], [], color="#333333", linestyle=":", linewidth=1.2)
            entries.append((dotted, f"end of pre-training ({pretrained[0].label})"))
        figure.suptitle(title)
        columns = min(len(entries), 2 * len(panels))
        figure.legend(*zip(*entries, strict=True), loc="outside lower center", ncols=columns)
    return figure


def _draw_panel(axes: Axes, curves: Sequence[Curve], colours: Iterable[int]) -> list[Any]:
    """Draws curves into axes but for the axis of steps, and returns what stands for each in a legend.

    Args:
        colours: of each curve, by its index.
    """
    handles = [_draw_curve(axes, index, curve) for index, curve in zip(colours, curves, strict=True)]
    score = curves[0].score
    axes.set_ylabel(f"Champion's {score.label} on fresh episodes")
    if score.bounded:
        room = 0.02 * (score.upper - score.lower)
        axes.set_ylim(score.lower - room, score.upper + room)
        axes.set_yticks(np.linspace(score.lower, score.upper, 6))
    axes.grid(axis="y", color=GRID, linewidth=0.6)
    axes.set_axisbelow(True)
    return handles


def _linear_steps(axes: Axes, curves: Sequence[Curve]) -> None:
    """An axis from 0 to where the last seed ended."""
    ends = [float(np.max(steps)) for curve in curves for steps, _ in curve.per_seed]
    last = max(ends or [float(curve.band.steps[-1]) for curve in curves])
    axes.set_xlabel("Environment steps")
    # A little more room than needed, or the border would hide half of a line that runs along it.
    axes.set_xlim(0, 1.01 * last or 1)
    axes.xaxis.set_major_formatter(_step_formatter(last))


def _logarithmic_steps(axes: Axes, curves: Sequence[Curve]) -> None:
    """An axis from where the first mean begins, or pre-training ends if that is earlier, to the last end."""
    last = max(float(curve.band.steps[-1]) for curve in curves)
    begins = [float(curve.band.steps[0]) for curve in curves]
    begins += [float(curve.pretrained_at) for curve in curves if curve.pretrained_at]
    # At least one decade, so that there are ticks to read by even if all is a single point.
    first = min(*begins, last / 10)
    room = (last / first) ** 0.015
    axes.set_xlabel("Environment steps (logarithmic)")
    axes.set_xscale("log")
    axes.set_xlim(first / room, last * room)
    axes.xaxis.set_major_locator(FixedLocator(_ticks(first, last)))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda steps, _: _human(steps)))
    axes.xaxis.set_minor_locator(FixedLocator(_multiples(range(1, 10), first, last)))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.grid(axis="x", color=GRID, linewidth=0.6)


def _ticks(first: float, last: float) -> list[float]:
    """Where a logarithmic axis has labels: as many as fit, always at powers of ten."""
    decades = math.log10(last / first)
    leading = (1, 2, 5) if decades < 1.5 else (1, 3) if decades < 3 else (1,)
    return _multiples(leading, first, last)


def _multiples(leading: Sequence[int], first: float, last: float) -> list[float]:
    """Powers of ten times each of some digits, from `first` to `last`."""
    powers = range(math.floor(math.log10(first)), math.floor(math.log10(last)) + 1)
    candidates = [digit * 10.0**power for power in powers for digit in leading]
    return [steps for steps in candidates if first <= steps <= last]


def _draw_curve(axes: Axes, index: int, curve: Curve) -> tuple[Patch, Line2D] | Line2D:
    """Draws one curve and returns what stands for it in the legend."""
    colour = CURVE_COLOURS[index % len(CURVE_COLOURS)]
    dashes = ("-", "--", ":")[index // len(CURVE_COLOURS) % 3]
    band = curve.band
    # A line through one point is invisible: a run's first generation needs a dot.
    dot = "o" if len(band.steps) == 1 else ""
    for seed, (steps, values) in enumerate(curve.per_seed):
        kept = ~np.isnan(values)
        thin: dict[str, Any] = {"alpha": 0.25, "linewidth": 0.7, "marker": dot}
        axes.plot(steps[kept], values[kept], color=colour, gid=f"seed {seed}", **thin)
    bold: dict[str, Any] = {"linewidth": 2, "linestyle": dashes, "marker": dot, "zorder": 3}
    (mean,) = axes.plot(band.steps, band.mean, color=colour, gid="mean", **bold)
    if curve.pretrained_at is not None:
        axes.axvline(curve.pretrained_at, color=colour, linestyle=":", linewidth=1.2, gid="pre-training")
    if np.isnan(band.low).all():
        return mean
    axes.fill_between(band.steps, band.low, band.high, color=colour, alpha=0.2, linewidth=0, gid="band")
    return Patch(color=colour, alpha=0.2, linewidth=0), mean


def _curve_name(curve: Curve) -> str:
    """What the legend says of a curve."""
    n_seeds = len(curve.per_seed)
    statistics = f"mean of {n_seeds} seeds, 95 % interval" if n_seeds > 1 else "1 seed, no interval"
    dotted = "; dotted: end of pre-training" if curve.pretrained_at is not None else ""
    return f"{curve.label} ({statistics}{dotted})"


def _step_formatter(last: float) -> FuncFormatter:
    """Ticks as 0.5 M or 200 k: one unit for the whole axis, so that labels compare at a glance."""
    scale, suffix = next(((scale, suffix) for scale, suffix in UNITS if last >= scale / 2), (1, ""))
    return FuncFormatter(lambda steps, _: f"{steps / scale:g}{suffix}" if steps else "0")


def _human(steps: float) -> str:
    """100 k, 1 M, 10 M: each tick in its own unit, for a logarithmic axis spans several."""
    scale, suffix = next(((scale, suffix) for scale, suffix in UNITS if steps >= scale), (1, ""))
    return f"{steps / scale:g}{suffix}"
