"""Who chose which skill when, as in the histograms of Figures 4.2 and 4.3 of the thesis."""

import math
from collections.abc import Sequence

import matplotlib
import numpy as np
from jaxtyping import Float, Int
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from skillcrew.analysis.canvas import STYLE, layout
from skillcrew.analysis.statistics import skill_shares

POI_COLOURS = (
    ("#0B5FA5", "#86C5FF"),
    ("#D55E00", "#FFAE80"),
    ("#009E73", "#B8EBC8"),
    ("#8E3A80", "#E0A8D6"),
    ("#B08900", "#FFE680"),
    ("#5C3317", "#D7BFA8"),
)
"""Dark for going to a target, light for going away from it; blue, vermilion, green, purple, gold, brown.

With the grey pair, the first three pairs keep a distance of 18 in CIELAB between any two colours,
also as seen with deuteranopia, protanopia and tritanopia.
"""

AGENT_COLOURS = ("#333333", "#B0B0B0")
"""Of `go_to_agent` and `go_away_from_agent`: the same however many types of POIs come before."""

LEAST_RUNNING_SHARE = 0.01
"""Time steps that fewer of the episodes reach are drawn pale: their shares are mostly noise."""

_PALE = 0.3


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
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(4.0 + 2.6 * n_columns, 1.5 + 1.75 * n_rows), layout=layout())
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
    """What a skill is about, and whether it leads away from it; the same for all types of agents."""
    name = name.rpartition("/")[2]
    for prefix, away in (("go_to_", False), ("go_away_from_", True)):
        if name.startswith(prefix):
            return name.removeprefix(prefix), away
    return name, False


def readable_skill(name: str) -> str:
    """The name for human readers: "go to POI A" for `go_to_poi_A`."""
    return " ".join("POI" if word == "poi" else word for word in name.split("_"))
