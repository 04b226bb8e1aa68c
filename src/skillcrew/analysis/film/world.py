"""The world at a moment: whatever a scene's groups hold, drawn in the same way for all environments."""

import dataclasses
from typing import Any

import numpy as np
from jaxtyping import Float
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import Bbox

from skillcrew.analysis.film.episode import Episode
from skillcrew.analysis.film.marks import (
    CIRCLE,
    SHAPES,
    Marks,
    lower_part,
    outline,
    pointer,
    readable_on,
)
from skillcrew.analysis.page.colours import light_ground
from skillcrew.envs.scene import Points, Scene

TRAIL = 25
"""Steps that an agent's way is seen for; the same as on the page."""

GROUND = light_ground()

PLOT, TEXT, SOFT = GROUND["plot"], GROUND["text"], GROUND["soft"]


@dataclasses.dataclass(frozen=True)
class View:
    """Which part of the plane is shown, and where in the picture."""

    low: Float[np.ndarray, "2"]
    high: Float[np.ndarray, "2"]
    left: float | int
    top: float | int
    scale: float
    """Pixels to a unit of the scene."""

    def place(self, position: Any) -> Float[np.ndarray, "*any 2"]:
        """Where something is in the picture, of places [..., 2] in the scene."""
        position = np.asarray(position, float)
        x = self.left + (position[..., 0] - self.low[0]) * self.scale
        return np.stack([x, self.top + (self.high[1] - position[..., 1]) * self.scale], axis=-1)

    @property
    def box(self) -> Bbox:
        """All of it, in the picture."""
        return Bbox([self.place(self.low), self.place(self.high)])


def bounds(episode: Episode) -> tuple[Float[np.ndarray, "2"], Float[np.ndarray, "2"]]:
    """Corners of what is shown: what the scene says, and up to a quarter of it on each side."""
    scene = episode.scene
    low, high = np.array(scene.low, float), np.array(scene.high, float)
    room = (high - low) / 4
    reach = [
        (np.asarray(group.position, float).reshape(-1, 2), np.zeros(1))
        for group in scene.points
        if group.name == "agents"
    ]
    reach += [
        (np.asarray(group.position[0], float), np.asarray(group.radius[0], float)[:, None])
        for group in scene.discs
        if group.name != "sensors"
    ]
    from_, to = low.copy(), high.copy()
    for position, radius in reach:
        if len(position):
            from_ = np.fmin(from_, np.fmax(np.fmin.reduce(position - radius), low - room))
            to = np.fmax(to, np.fmin(np.fmax.reduce(position + radius), high + room))
    rim = 0.015 * (to - from_).max()
    return from_ - rim, to + rim


def draw_ground(marks: Marks, scene: Scene, view: View) -> None:
    """A grid with its numbers, and the border of what the scene says is to be shown."""
    (left, floor), (right, top) = view.place(view.low), view.place(view.high)
    for axis in (0, 1):
        ticks = MaxNLocator(nbins=5, steps=[1, 2, 2.5, 5, 10]).tick_values(view.low[axis], view.high[axis])
        for tick in ticks[(ticks >= view.low[axis]) & (ticks <= view.high[axis])]:
            x, y = view.place(np.where(np.arange(2) == axis, tick, view.low))
            if axis == 0:
                marks.line((x, top), (x, floor), GROUND["faint"], 1)
                marks.word(f"{tick:g}", (x, floor + 11), 10.5, SOFT)
            else:
                marks.line((left, y), (right, y), GROUND["faint"], 1)
                marks.word(f"{tick:g}", (left - 6, y), 10.5, SOFT, align=1)
    corners = np.array([scene.low, (scene.high[0], scene.low[1]), scene.high, (scene.low[0], scene.high[1])])
    places = view.place(corners)
    for start, end in zip(places, np.roll(places, -1, axis=0), strict=True):
        marks.line(start, end, GROUND["line"], 1.5)


def draw_things(marks: Marks, episode: Episode, view: View, moment: float | int, size: float | int) -> None:
    """All that may be cut off at the border: discs, lines, trails, things and labels, in this order.

    Args:
        size: of things, in pixels.
    """
    scene = episode.at(moment)
    for group in scene.discs:
        if group.name != "sensors":
            _draw_discs(marks, episode, group, view)
    for group in scene.lines:
        for thing in _there(group, len(group.start)):
            start, end = view.place(group.start[thing]), view.place(group.end[thing])
            marks.line(start, end, SOFT, 2.5)
    agents = agents_of(episode.scene)
    if agents is not None:
        _draw_trails(marks, episode, agents, view, moment)
    for index, group in enumerate(group for group in scene.points if group.name != "agents"):
        for thing in _there(group, len(group.position)):
            colour = episode.colour_of(group, thing, SOFT)
            place = view.place(group.position[thing])
            draw_thing(marks, SHAPES[index % len(SHAPES)], place, size, colour, _full(group, thing))
    for group in scene.labels:
        for text, place in zip(group.texts, view.place(group.position), strict=True):
            marks.word(text, (place[0], place[1] - size - 9), 12, TEXT, bold=True, rim=PLOT)


def draw_agents(marks: Marks, episode: Episode, view: View, moment: float | int, size: float | int) -> None:
    """Discs with numbers, each in the colour of its skill; who has gone out of sight stands at the border."""
    group = agents_of(episode.at(moment))
    if group is None:
        return
    followed = episode.followed(moment)
    for agent in _there(group, len(group.position)):
        place = view.place(np.clip(group.position[agent], view.low, view.high))
        colour = episode.skill_colours[followed[agent]]
        out = group.state is not None and group.state[agent] > 0
        look: dict[str, Any] = {"fill": colour, "line": TEXT, "width": 1.4, "alpha": 0.55 if out else 1.0}
        if group.heading is not None and np.isfinite(group.heading[agent]):
            marks.add(pointer(float(group.heading[agent])), place, size, **look)
        marks.add(CIRCLE, place, size, **look)
        if size >= 7:
            marks.word(str(agent + 1), place, round(1.3 * size), readable_on(colour), bold=True)
        if out:
            for rise in (-size, size):
                start, end = (place[0] - size, place[1] - rise), (place[0] + size, place[1] + rise)
                marks.line(start, end, TEXT, 2)


def draw_thing(
    marks: Marks, shape: str, place: Any, size: float | int, colour: str, full: float | int
) -> None:
    """An outline that is full from below by a share of its height."""
    marks.add(outline(shape), place, size, fill=PLOT)
    if full > 0:
        marks.add(lower_part(shape, full), place, size, fill=colour)
    marks.add(outline(shape), place, size, line=colour, width=2)


def draw_disc(
    marks: Marks, place: Any, radius: float | int, colour: str, full: float | int, dashed: bool
) -> None:
    """A circle, the more opaque the fuller."""
    look = (0.06 + 0.14 * full, 0.75)
    marks.add(CIRCLE, place, max(radius, 0.5), colour, colour, 1.3, alpha=look, dashed=dashed)


def fullness(group: Any, state: Any) -> float:
    """How full a mark is: empty in the first state, full in the last."""
    return 1.0 if len(group.states) < 2 else min(float(state) / (len(group.states) - 1), 1.0)


def agents_of(scene: Scene) -> Points | None:
    """The points that are the agents; None if there are none."""
    return next((group for group in scene.points if group.name == "agents"), None)


def _draw_discs(marks: Marks, episode: Episode, group: Any, view: View) -> None:
    for thing in _there(group, len(group.position)):
        full, place = _full(group, thing), view.place(group.position[thing])
        opaque = full if len(group.states) > 1 else 0.3
        colour = episode.colour_of(group, thing, SOFT)
        draw_disc(marks, place, float(group.radius[thing]) * view.scale, colour, opaque, dashed=full == 0)


def _draw_trails(marks: Marks, episode: Episode, agents: Points, view: View, moment: float | int) -> None:
    """Where agents have come from, in the colours of the skills that they followed there."""
    places = view.place(agents.position)
    now = agents_of(episode.at(moment))
    last = places[0] if now is None else view.place(now.position)
    for step in range(max(0, int(np.ceil(moment)) - TRAIL), int(np.ceil(moment))):
        end = min(step + 1, moment)
        ends = places[step + 1] if end == step + 1 else last
        pale = 0.15 + 0.65 * (1 - (moment - end) / TRAIL)
        for agent, skill in enumerate(episode.followed(step)):
            colour = episode.skill_colours[skill]
            marks.line(places[step, agent], ends[agent], colour, 3, pale)


def _there(group: Any, count: int) -> list[int]:
    """Which of its things are to be drawn."""
    return [thing for thing in range(count) if group.state is None or group.state[thing] >= 0]


def _full(group: Any, thing: int) -> float:
    return 1.0 if group.state is None else fullness(group, group.state[thing])
