"""Marks of a picture: what differs differs in shape or filling too, not in colour alone."""

import functools
import math
import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.collections import PathCollection
from matplotlib.colors import to_rgba
from matplotlib.font_manager import FontProperties
from matplotlib.path import Path
from matplotlib.textpath import TextPath
from matplotlib.transforms import Bbox, IdentityTransform, TransformedBbox

from skillcrew.errors import one_line

SHAPES = ("diamond", "square", "triangle", "hexagon")
"""Of groups of things, in their order; the same as on the page."""

CORNERS = {"diamond": (4, 90.0), "square": (4, 45.0), "triangle": (3, 30.0), "hexagon": (6, 90.0)}
"""How many each has, and in which direction the first, in degrees."""

CIRCLE = Path.unit_circle()

DASHES = (0, (3.5, 2.8))
"""In widths of the line."""

Place = Sequence[float | int] | Float[np.ndarray, "2"]

FAR = 1e5
"""Pixels; what is further away, or no number, is not drawn."""

NONE = (0.0, 0.0, 0.0, 0.0)


class Marks:
    """Marks that are drawn in the order in which they come, places in pixels from the upper left corner."""

    def __init__(self) -> None:
        self._paths: list[Path] = []
        self._places: list[tuple[float, float]] = []
        self._looks: dict[str, list[Any]] = {
            name: [] for name in ("sizes", "facecolors", "edgecolors", "linewidths", "linestyles")
        }

    def add(
        self,
        path: Path,
        place: Place,
        size: float | int = 1.0,
        fill: str | None = None,
        line: str | None = None,
        width: float | int = 0.0,
        alpha: float | int | tuple[float, float] = 1.0,
        dashed: bool = False,
    ) -> None:
        """Draws a path, whose y points up, so many times as large; nothing where its place is none.

        Args:
            alpha: of filling and line, or of each.
        """
        if not _near(*place, size):
            return
        of_fill, of_line = alpha if isinstance(alpha, tuple) else (alpha, alpha)
        self._paths.append(path)
        self._places.append((float(place[0]), float(place[1])))
        looks = {
            "sizes": size**2,
            "facecolors": NONE if fill is None else to_rgba(fill, of_fill),
            "edgecolors": NONE if line is None else to_rgba(line, of_line),
            "linewidths": width if line is not None else 0.0,
            "linestyles": DASHES if dashed else "solid",
        }
        for name, look in looks.items():
            self._looks[name].append(look)

    def line(
        self, start: Place, end: Place, colour: str, width: float | int, alpha: float | int = 1.0
    ) -> None:
        """A straight piece."""
        if _near(*start, *end):
            path = Path([(0.0, 0.0), (end[0] - start[0], start[1] - end[1])])
            self.add(path, start, line=colour, width=width, alpha=alpha)

    def word(
        self,
        text: str,
        place: Place,
        size: float | int,
        colour: str,
        align: float | int = 0.5,
        bold: bool = False,
        rim: str | None = None,
    ) -> None:
        """A text whose middle is at the height of a place.

        Args:
            align: share of it that stands left of the place.
            rim: colour of what surrounds it, so that it is read on anything.
        """
        path = word_path(text, size, bold)
        place = (place[0] - align * width_of(text, size, bold), place[1] + 0.36 * size)
        if rim is not None:
            self.add(path, place, line=rim, width=3.5)
        self.add(path, place, fill=colour)

    def artist(self, axes: Axes, within: Bbox | None = None) -> PathCollection:
        """All of them as one artist on axes whose data are pixels, cut off beyond a box."""
        artist = PathCollection(
            self._paths,
            offsets=np.reshape(self._places, (-1, 2)),
            offset_transform=axes.transData,
            transform=IdentityTransform(),
            capstyle="butt",
            joinstyle="round",
            **self._looks,
        )
        axes.add_collection(artist, autolim=False)
        if within is None:
            artist.set_clip_on(False)
        else:
            artist.set_clip_box(TransformedBbox(within, axes.transData))
        return artist


def _near(*numbers: Any) -> bool:
    return all(abs(number) < FAR for number in numbers)


@functools.cache
def outline(shape: str) -> Path:
    """A shape about 1 wide on each side of its middle."""
    count, first = CORNERS[shape]
    angles = np.radians(first + 360 * np.arange(count + 1) / count)
    return Path(1.15 * np.stack([np.cos(angles), np.sin(angles)], axis=1), closed=True)


def bar(width: float | int, height: float | int) -> Path:
    """A box that hangs down from its upper left corner."""
    return Path([(0, 0), (width, 0), (width, -height), (0, -height), (0, 0)], closed=True)


@functools.cache
def lower_part(shape: str, share: float | int) -> Path:
    """What of a shape is below a share of its height."""
    return outline(shape).clip_to_bbox(Bbox([[-2, -2], [2, 2 * share - 1]])) if share < 1 else outline(shape)


def pointer(heading: float | int) -> Path:
    """A wedge from a disc of radius 1 towards a heading, in radians."""
    tips = [(1.95, 0.0), (0.85, 0.62), (0.85, -0.62), (1.95, 0.0)]
    corners = [(far * math.cos(heading + side), far * math.sin(heading + side)) for far, side in tips]
    return Path(corners, closed=True)


@functools.cache
def word_path(text: str, size: float | int, bold: bool = False) -> Path:
    """The outlines of a text's letters, in pixels; what they stand for is never taken for a formula."""
    if not text:
        return Path(np.zeros((0, 2)))
    font = FontProperties(family="DejaVu Sans", weight="bold" if bold else "normal")
    with warnings.catch_warnings():
        # A letter that the font lacks is a box in the picture.
        warnings.simplefilter("ignore", UserWarning)
        return TextPath((0, 0), one_line(text).replace("$", r"\$"), size=size, prop=font)


@functools.cache
def width_of(text: str, size: float | int, bold: bool = False) -> float:
    """Of a text in pixels."""
    path = word_path(text, size, bold)
    return float(np.asarray(path.vertices)[:, 0].max(initial=0.0))


def fitting(text: str, size: float | int, room: float | int, bold: bool = False) -> str:
    """As much of a text as there is room for."""
    text = one_line(text)
    if width_of(text, size, bold) <= room:
        return text
    ends = (f"{text[:length]}…" for length in range(min(len(text), 200), -1, -1))
    return next((end for end in ends if width_of(end, size, bold) <= room), "")


def readable_on(colour: str) -> str:
    """Black or white, whichever is read better on a colour."""
    red, green, blue, _ = to_rgba(colour)
    return "#000000" if 0.299 * red + 0.587 * green + 0.114 * blue > 0.58 else "#ffffff"
