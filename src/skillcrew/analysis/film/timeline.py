"""Who follows which skill when, as rows of colour, and what changes its state when."""

import math

import numpy as np
from matplotlib.ticker import MaxNLocator

from skillcrew.analysis.film.episode import Episode
from skillcrew.analysis.film.marks import Marks, bar
from skillcrew.analysis.film.world import SOFT, TEXT, draw_thing, fullness


class Timeline:
    """Rows of agents over the steps of an episode.

    Args:
        episode: whose.
        left: of the first step, in pixels.
        right: of the end.
        top: of all of it.
    """

    def __init__(self, episode: Episode, left: float | int, right: float | int, top: float | int):
        self._episode, self._left, self._right = episode, left, right
        self._events = episode.events()
        self._top = top + (14 if self._events else 0)
        self._row = min(13.0, 160 / episode.choice.shape[1])
        self._foot = self._top + self._row * episode.choice.shape[1]
        self.floor = self._foot + 34
        """Of what is written below the rows, too."""

    def _x(self, step: float | int) -> float:
        return self._left + (self._right - self._left) * step / self._episode.steps

    def draw(self, marks: Marks) -> None:
        """All but the moment."""
        for agent, choices in enumerate(self._episode.choice.T):
            self._draw_row(marks, agent, choices)
        scale = MaxNLocator(nbins=8, integer=True, steps=[1, 2, 5, 10])
        for tick in np.asarray(scale.tick_values(0, self._episode.steps)).tolist():
            if not 0 <= tick <= self._episode.steps:
                continue
            marks.word(f"{tick:g}", (self._x(tick), self._foot + 10), 10.5, SOFT)
        marks.word("time step", (self._x(self._episode.steps / 2), self._foot + 25), 10.5, SOFT)
        for step, group, thing, state in self._events:
            colour, full = self._episode.colour_of(group, thing, SOFT), fullness(group, state)
            draw_thing(marks, "diamond", (self._x(step), self._top - 8), 4, colour, full)

    def draw_moment(self, marks: Marks, moment: float | int) -> None:
        """Where in the episode it is."""
        x = self._x(moment)
        marks.line((x, self._top - 3), (x, self._foot + 3), TEXT, 2)

    def _draw_row(self, marks: Marks, agent: int, choices: np.ndarray) -> None:
        y, gap = self._top + agent * self._row, min(2.0, self._row / 4)
        starts = np.flatnonzero(np.diff(choices, prepend=-1)).tolist()
        for start, end in zip(starts, [*starts[1:], len(choices)], strict=True):
            marks.add(
                bar(self._x(end) - self._x(start) - (1 if end < len(choices) else 0), self._row - gap),
                (self._x(start), y),
                fill=self._episode.skill_colours[choices[start]],
            )
        every = 1 if self._row >= 9 else 5 * math.ceil(11 / (5 * self._row))
        if agent % every == 0:
            marks.word(str(agent + 1), (self._left - 7, y + self._row / 2 - 1), 10.5, SOFT, align=1)
