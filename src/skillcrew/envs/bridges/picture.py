"""Scenes as pixels."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from jaxtyping import UInt8
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import EllipseCollection, LineCollection
from matplotlib.figure import Figure

from skillcrew.envs.scene import Discs, Labels, Lines, Points, Scene

COLOURS = [colormaps["tab10"](index)[:3] for index in range(10)]
MARKS = "o^sDvP*X"
DOTS_PER_INCH = 100


def picture(scene: Scene, side: int = 480) -> UInt8[np.ndarray, "height width 3"]:
    """Draws one moment.

    Args:
        side: pixels of the longer side of what is shown.
    """
    low, high = np.asarray(scene.low), np.asarray(scene.high)
    width, height = side * (high - low) / (high - low).max() / DOTS_PER_INCH
    figure = Figure(figsize=(width, height), dpi=DOTS_PER_INCH)
    canvas = FigureCanvasAgg(figure)
    axes = figure.add_axes((0, 0, 1, 1), xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    axes.set_axis_off()
    colour = iter(range(10**6))
    for discs in scene.discs:
        _draw_discs(axes, discs, next(colour))
    for lines in scene.lines:
        _draw_lines(axes, lines, next(colour))
    for index, points in enumerate(scene.points):
        _draw_points(axes, points, MARKS[index % len(MARKS)], next(colour), float((high - low).max()))
    for labels in scene.labels:
        _write(axes, labels)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()


def _parts(things: Any, colour: int) -> Iterator[tuple[np.ndarray, Any]]:
    """Which things are drawn in which colour: one for each state that they can be in."""
    if things.state is None:
        count = len(things.start if isinstance(things, Lines) else things.position)
        yield np.arange(count), COLOURS[colour % len(COLOURS)]
        return
    state = np.asarray(things.state)
    for index in np.unique(state[state >= 0]):
        yield np.flatnonzero(state == index), COLOURS[(colour + int(index)) % len(COLOURS)]


def _draw_discs(axes: Axes, discs: Discs, colour: int) -> None:
    position, radius = np.asarray(discs.position), np.asarray(discs.radius)
    for which, shade in _parts(discs, colour):
        size = 2 * radius[which]
        flat = np.zeros(len(which))
        axes.add_collection(
            EllipseCollection(
                size, size, flat, units="xy", offsets=position[which], offset_transform=axes.transData,
                facecolors=[(*shade, 0.15)], edgecolors=[(*shade, 0.6)], zorder=1,
            ),
            autolim=False,
        )  # fmt: skip


def _draw_lines(axes: Axes, lines: Lines, colour: int) -> None:
    ends = np.stack([np.asarray(lines.start), np.asarray(lines.end)], axis=1)
    for which, shade in _parts(lines, colour):
        axes.add_collection(LineCollection(list(ends[which]), colors=[shade], zorder=2), autolim=False)


def _draw_points(axes: Axes, points: Points, mark: str, colour: int, extent: float) -> None:
    position = np.asarray(points.position)
    for which, shade in _parts(points, colour):
        x, y = position[which].T
        axes.scatter(x, y, s=50, marker=mark, color=[shade], zorder=3)
        if points.heading is not None:
            angle = np.asarray(points.heading)[which]
            tip = position[which] + 0.05 * extent * np.stack([np.cos(angle), np.sin(angle)], axis=1)
            needles = list(np.stack([position[which], tip], axis=1))
            axes.add_collection(
                LineCollection(needles, colors=[shade], linewidths=2, zorder=3), autolim=False
            )


def _write(axes: Axes, labels: Labels) -> None:
    for (x, y), text in zip(np.asarray(labels.position), labels.texts, strict=True):
        axes.text(x, y, text, ha="center", va="center", fontsize=8, zorder=4)
