"""One moment of an episode as a picture: the world, and below it who follows which skill when."""

import math

import numpy as np
from jaxtyping import UInt8
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PathCollection
from matplotlib.figure import Figure

from skillcrew.analysis.film.episode import Episode
from skillcrew.analysis.film.legend import draw_legend
from skillcrew.analysis.film.marks import Marks, fitting, width_of
from skillcrew.analysis.film.timeline import Timeline
from skillcrew.analysis.film.world import (
    PLOT,
    SOFT,
    TEXT,
    View,
    bounds,
    draw_agents,
    draw_ground,
    draw_things,
)

WIDEST = 720
"""Pixels; what is wider is the same picture, larger."""

HEAD, LEFT, RIGHT, AXIS, MARGIN = 46.0, 34.0, 14.0, 22.0, 12.0
"""Pixels above the world, beside it, and below it."""


class Picture:
    """Pictures of one episode, all of one size.

    What never changes is drawn once. Widths and heights are even, as films want them.

    Args:
        episode: what to draw.
        width: in pixels.
    """

    def __init__(self, episode: Episode, width: int):
        self._episode = episode
        pixels = width // 2 * 2
        self._larger = max(1.0, pixels / WIDEST)
        self._width = pixels / self._larger
        self.view = self._placed()
        floor = float(self.view.place(self.view.low)[1])
        fixed = Marks()
        self._timeline = Timeline(episode, LEFT, self._width - RIGHT, floor + AXIS + MARGIN)
        self._draw_head(fixed)
        draw_ground(fixed, episode.scene, self.view)
        self._timeline.draw(fixed)
        end = draw_legend(fixed, episode, LEFT, self._width - RIGHT, self._timeline.floor + MARGIN)
        pixels_high = math.ceil((end + MARGIN) * self._larger / 2) * 2
        self.size = pixels, pixels_high
        # A little more, for a size that is rounded down must not lose a pixel.
        inches = [(side + 1e-6) / (72 * self._larger) for side in self.size]
        self.figure = Figure(figsize=(inches[0], inches[1]), dpi=72 * self._larger, facecolor=PLOT)
        self._canvas = FigureCanvasAgg(self.figure)
        self._axes = self.figure.add_axes((0, 0, 1, 1))
        self._axes.set_axis_off()
        self._axes.set(xlim=(0, self._width), ylim=(pixels_high / self._larger, 0))
        self._moving: list[PathCollection] = []
        fixed.artist(self._axes)
        self._canvas.draw()
        self._ground = self._canvas.copy_from_bbox(self.figure.bbox)

    def show(self, moment: float | int) -> Figure:
        """The figure at a moment, from 0 to the number of steps."""
        for artist in self._moving:
            artist.remove()
        things, agents = Marks(), Marks()
        draw_things(things, self._episode, self.view, moment, self.mark)
        draw_agents(agents, self._episode, self.view, moment, self.mark)
        self._timeline.draw_moment(agents, moment)
        step = f"step {int(moment)} of {self._episode.steps}"
        agents.word(step, (self._width - RIGHT, 17), 14, TEXT, align=1, bold=True)
        self._moving = [things.artist(self._axes, within=self.view.box), agents.artist(self._axes)]
        return self.figure

    def frame(self, moment: float | int) -> UInt8[np.ndarray, "height width 3"]:
        """The picture at a moment, red, green and blue."""
        self.show(moment)
        self._canvas.restore_region(self._ground)
        for artist in self._moving:
            self._axes.draw_artist(artist)
        return np.asarray(self._canvas.buffer_rgba())[..., :3]

    @property
    def mark(self) -> float:
        """Radius of agents and things: large enough for numbers, unless they would hide each other."""
        agents = self._episode.choice.shape[1]
        return max(3.5 if agents > 16 else 7.5, min(9.0, self._width / 55))

    def _placed(self) -> View:
        low, high = bounds(self._episode)
        spans, room = high - low, self._width - LEFT - RIGHT
        scale = float(min(room / spans[0], 1.1 * room / spans[1]))
        return View(low, high, LEFT + (room - scale * spans[0]) / 2, HEAD, scale)

    def _draw_head(self, marks: Marks) -> None:
        episode, right = self._episode, self._width - RIGHT
        steps = f"step {episode.steps} of {episode.steps}"
        title = fitting(episode.title, 14, right - MARGIN - 20 - width_of(steps, 14, True), bold=True)
        marks.word(title, (MARGIN, 17), 14, TEXT, align=0, bold=True)
        outcome = fitting(episode.outcome, 12, (right - MARGIN) / 2)
        marks.word(outcome, (right, 35), 12, SOFT, align=1)
        which = f"seed {episode.seed}, episode {episode.number}"
        marks.word(fitting(which, 12, (right - MARGIN) / 2), (MARGIN, 35), 12, SOFT, align=0)
