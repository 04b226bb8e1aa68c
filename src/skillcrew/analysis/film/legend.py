"""What the colours and the marks of a picture mean."""

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

from skillcrew.analysis.film.episode import Episode
from skillcrew.analysis.film.marks import SHAPES, Marks, bar, fitting, width_of
from skillcrew.analysis.film.world import SOFT, TEXT, draw_disc, draw_thing, fullness

SIZE, ROW, MARK, GAP = 12, 21.0, 20.0, 14.0
"""Pixels: letters, a row, the room of a mark, and between two entries."""

MOST_ROWS = 6
"""What does not fit into them is left out."""


class Entry(NamedTuple):
    """A mark, and a word."""

    word: str
    draw: Callable[[Marks, float, float], None] | None = None
    """The mark around a place; None for a heading."""


def draw_legend(
    marks: Marks, episode: Episode, left: float | int, right: float | int, top: float | int
) -> float:
    """Rows of entries: the skills that are followed in the episode, and what there is in the world.

    Returns:
        Where the last row ends.
    """
    row = 0
    for entries in (_skills(episode), _things(episode)):
        x = left
        for entry in entries:
            room = 0.0 if entry.draw is None else MARK
            word = fitting(entry.word, SIZE, right - left - room)
            width = room + width_of(word, SIZE)
            if x > left and x + width > right:
                x, row = left, row + 1
            if row >= MOST_ROWS:
                break
            y = top + (row + 0.5) * ROW
            if entry.draw is not None:
                entry.draw(marks, x + MARK / 2 - 3, y)
            marks.word(word, (x + room, y), SIZE, SOFT if entry.draw is None else TEXT, align=0)
            x += width + (GAP / 2 if entry.draw is None else GAP)
        row += x > left
    return top + min(row, MOST_ROWS) * ROW


def _skills(episode: Episode) -> Iterator[Entry]:
    for skill in np.unique(episode.choice):
        colour = episode.skill_colours[skill]

        def chip(marks: Marks, x: float, y: float, colour: str = colour) -> None:
            marks.add(bar(12, 12), (x - 6, y - 6), fill=colour)

        yield Entry(episode.skills[skill], chip)


def _things(episode: Episode) -> Iterator[Entry]:
    """Each group of things in each of its kinds and states; circles and lines by their names."""
    things = [group for group in episode.scene.points if group.name != "agents"]
    for index, group in enumerate(things):
        yield from _of_things(episode, group, SHAPES[index % len(SHAPES)])
    for group in episode.scene.discs:
        if group.name != "sensors":
            colour = SOFT if group.kinds else episode.colour_of(group, 0, SOFT)
            yield Entry(group.name, lambda marks, x, y, colour=colour: _circle(marks, x, y, colour))
    for group in episode.scene.lines:
        yield Entry(group.name, lambda marks, x, y: marks.line((x - 8, y), (x + 8, y), SOFT, 2.5))


def _of_things(episode: Episode, group: Any, shape: str) -> Iterator[Entry]:
    def mark(colour: str, full: float | int) -> Callable[[Marks, float, float], None]:
        return lambda marks, x, y: draw_thing(marks, shape, (x, y), 6.5, colour, full)

    neutral = SOFT if group.kinds else episode.colour_of(group, 0, SOFT)
    states = group.states if len(group.states) > 1 else ()
    entries = [Entry(kind, mark(episode.colours.get(kind, SOFT), 1.0)) for kind in dict.fromkeys(group.kinds)]
    entries += [Entry(word, mark(neutral, fullness(group, state))) for state, word in enumerate(states)]
    if entries:
        yield Entry(f"{group.name}:")
        yield from entries
    else:
        yield Entry(group.name, mark(neutral, 1.0))


def _circle(marks: Marks, x: float, y: float, colour: str) -> None:
    draw_disc(marks, (x, y), 7.5, colour, 0.3, dashed=False)
