"""Learning curves and skill histograms, as in Figures 4.2 and 4.3 of the thesis.

Figures are built object by object: `pyplot` keeps every figure alive and chooses a window system,
neither of which a library may do to its user.
"""

import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from jaxtyping import Float, Int, Real
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter, MaxNLocator

from skillcrew.analysis.statistics import Band, skill_shares
from skillcrew.errors import UserError

CURVE_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#AA4499", "#E69F00", "#56B4E9", "#333333")
"""Okabe and Ito's colours (with a stronger purple), which colour-blind readers tell apart."""

POI_COLOURS = (
    ("#0B5FA5", "#86C5FF"),
    ("#D55E00", "#FFAE80"),
    ("#009E73", "#B8EBC8"),
    ("#8E3A80", "#E0A8D6"),
    ("#B08900", "#FFE680"),
)
"""Dark for going to a target, light for going away from it; blue, vermilion, green, purple, gold.

With the grey pair, the first three pairs keep a distance of 18 in CIELAB between any two colours,
also as seen with deuteranopia, protanopia and tritanopia.
"""

AGENT_COLOURS = ("#333333", "#B0B0B0")
"""Of `go_to_agent` and `go_away_from_agent`: the same however many types of POIs come before."""

LEAST_RUNNING_SHARE = 0.01
"""Time steps that fewer of the episodes reach are drawn pale: their shares are mostly noise."""

_PALE = 0.3
_STYLE: dict[Any, Any] = {
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


def _layout() -> ConstrainedLayoutEngine:
    """Keeps labels and legends from touching each other or the border (inches)."""
    return ConstrainedLayoutEngine(w_pad=0.08, h_pad=0.08)


@dataclass(frozen=True, eq=False)
class Curve:
    """One line of a comparison: an algorithm in one environment, over its seeds."""

    label: str
    band: Band
    """The mean over seeds, in [0, 1], with its interval."""
    per_seed: Sequence[tuple[Real[np.ndarray, " _"], Real[np.ndarray, " _"]]]
    """For each seed its environment steps and values; rows with NaN are skipped."""
    pretrained_at: float | None = None
    """Environment steps after which pre-training ended (MFL); marked by a dotted line."""


def learning_curves(curves: Sequence[Curve], title: str) -> Figure:
    """Success rates over environment steps: each seed faint, the mean bold, its 95 % band shaded.

    Args:
        curves: at least one; colours repeat after seven, with other dashes.
        title: stands above the axes.

    Raises:
        UserError: no curves.
    """
    if not curves:
        raise UserError("there are no learning curves to draw")
    with matplotlib.rc_context(_STYLE):
        # Each entry of the legend takes its own height and none from the axes.
        figure = Figure(figsize=(6.4, 3.9 + 0.2 * len(curves)), layout=_layout())
        axes = figure.subplots()
        handles: list[Any] = [_draw_curve(axes, index, curve) for index, curve in enumerate(curves)]
        axes.set_title(title, fontsize=11)
        axes.set_xlabel("Environment steps")
        axes.set_ylabel("Champion's success rate on fresh episodes")
        last = max(float(np.max(steps)) for curve in curves for steps, _ in curve.per_seed)
        # A little more room than needed, or the border would hide half of a line that runs along it.
        axes.set_xlim(0, 1.01 * last or 1)
        axes.set_ylim(-0.02, 1.02)
        axes.set_yticks(np.linspace(0, 1, 6))
        axes.xaxis.set_major_formatter(_step_formatter(last))
        axes.grid(axis="y", color="#E6E6E6", linewidth=0.6)
        axes.set_axisbelow(True)
        names = [_curve_name(curve) for curve in curves]
        figure.legend(handles, names, loc="outside lower center")
    return figure


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
    units = ((1e9, " G"), (1e6, " M"), (1e3, " k"))
    scale, suffix = next(((scale, suffix) for scale, suffix in units if last >= scale / 2), (1, ""))
    return FuncFormatter(lambda steps, _: f"{steps / scale:g}{suffix}" if steps else "0")


def skill_distribution(
    choices: Int[np.ndarray, "episodes time agents"], skill_names: Sequence[str], title: str
) -> Figure:
    """Which skill each agent chooses over the course of an episode.

    One panel per agent: at each time step the share of the episodes still running in which the
    agent chose each skill, stacked. A grey strip below says how many episodes run at that step;
    where fewer than `LEAST_RUNNING_SHARE` of them do, the shares are drawn pale.

    Args:
        choices: skill indices, and -1 for all agents after an episode's end; see `skill_shares`.
        skill_names: the environment's `skills`, in the order of the indices.
        title: stands above all panels.

    Raises:
        UserError: no episodes, or none with a single step.
        ValueError: choices that name no skill, or end for some agents only; see `skill_shares`.
    """
    shares, running = skill_shares(choices, len(skill_names))
    n_agents = shares.shape[1]
    n_columns = 1 if n_agents <= 3 else 2
    n_rows = math.ceil(n_agents / n_columns)
    drawn_fully = running >= LEAST_RUNNING_SHARE * len(choices)
    colours = skill_colours(skill_names)
    with matplotlib.rc_context(_STYLE):
        figure = Figure(figsize=(4.0 + 2.6 * n_columns, 1.5 + 1.75 * n_rows), layout=_layout())
        grid = figure.subplots(
            n_rows + 1, n_columns, sharex=True, squeeze=False, height_ratios=[*[1.0] * n_rows, 0.3]
        )
        for agent, axes in enumerate(grid[:-1].flat):
            if agent < n_agents:
                _draw_shares(axes, shares[:, agent], drawn_fully, colours)
                axes.set_title(f"Agent {agent + 1}" if n_agents > 1 else "", loc="left")
            else:
                axes.set_visible(False)
        for column, axes in enumerate(grid[-1]):
            _draw_running(axes, running, len(choices), labelled=column == 0)
        figure.supylabel("Share of episodes still running", fontsize=9)
        figure.suptitle(title)
        # Top to bottom as the areas are stacked.
        handles = [Patch(facecolor=colour) for colour in reversed(colours)]
        names = [readable_skill(name) for name in reversed(skill_names)]
        figure.legend(handles, names, loc="outside right center", title="Skill", alignment="left")
    return figure


def _draw_shares(
    axes: Axes,
    shares: Float[np.ndarray, "time skills"],
    drawn_fully: np.ndarray,
    colours: Sequence[str],
) -> None:
    """Stacks one agent's shares; time step t, counted from 1, spans t - 0.5 to t + 0.5."""
    edges = np.arange(len(shares) + 1) + 0.5
    tops = np.cumsum(shares, axis=1)
    for skill, colour in enumerate(colours):
        base = tops[:, skill - 1] if skill else np.zeros(len(shares))
        for part, alpha in ((drawn_fully, 1.0), (~drawn_fully, _PALE)):
            # Stairs leave gaps at NaN: each of the two draws its own time steps.
            top = np.where(part, tops[:, skill], np.nan)
            axes.stairs(top, edges, baseline=base, fill=True, color=colour, alpha=alpha, linewidth=0)
    axes.set_ylim(0, 1)
    axes.set_yticks([0, 0.5, 1])


def _draw_running(axes: Axes, running: Int[np.ndarray, " time"], n_episodes: int, labelled: bool) -> None:
    """The strip at the foot of a column: episodes still running at each time step."""
    edges = np.arange(len(running) + 1) + 0.5
    axes.stairs(running, edges, fill=True, color="#8C8C8C", alpha=0.6, linewidth=0)
    axes.set_ylim(0, n_episodes)
    axes.set_yticks([0, n_episodes])
    axes.set_xlim(edges[0], edges[-1])
    axes.xaxis.set_major_locator(MaxNLocator(nbins=8, integer=True, steps=[1, 2, 5, 10]))
    axes.set_xlabel("Time step")
    axes.set_title("Episodes still running" if labelled else "", loc="left")


def skill_colours(skill_names: Sequence[str]) -> list[str]:
    """A colour for each skill: a hue per target, dark for going to it, light for going away.

    A skill of any other name is a target of its own. Hues repeat after five targets.
    """
    parsed = [_target(name) for name in skill_names]
    targets = list(dict.fromkeys(target for target, _ in parsed if target != "agent"))
    pairs = {target: POI_COLOURS[index % len(POI_COLOURS)] for index, target in enumerate(targets)}
    pairs["agent"] = AGENT_COLOURS
    return [pairs[target][away] for target, away in parsed]


def _target(name: str) -> tuple[str, bool]:
    """What a skill is about, and whether it leads away from it."""
    for prefix, away in (("go_to_", False), ("go_away_from_", True)):
        if name.startswith(prefix):
            return name.removeprefix(prefix), away
    return name, False


def readable_skill(name: str) -> str:
    """The name for human readers: "go to POI A" for `go_to_poi_A`."""
    return " ".join("POI" if word == "poi" else word for word in name.split("_"))


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
    """Writes one file beside its place, then moves it there."""
    # In the same folder, for a move between file systems is not atomic.
    partial = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            with matplotlib.rc_context(_STYLE):
                figure.savefig(partial, format=kind, dpi=150, metadata=metadata)
            os.replace(partial, path)
        finally:
            partial.unlink(missing_ok=True)
    except OSError as error:
        raise UserError(f"cannot write {path}: {error.strerror or error}") from error
    return path
