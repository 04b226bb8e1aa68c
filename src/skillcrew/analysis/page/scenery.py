"""Recorded episodes as the page takes them: what is there to draw, and where it is at each moment."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Int

from skillcrew.analysis.page.colours import both_grounds, colours_of_kinds
from skillcrew.analysis.page.packing import as_reading, as_turn, on_grid, pack, short
from skillcrew.envs.scene import Scene
from skillcrew.errors import UserError
from skillcrew.experiment.recording import Shown

PARTS = ("discs", "lines", "points", "labels")
"""In the order in which they are drawn."""

ENDS = {"x": ("position", 0), "y": ("position", 1)}
ENDS_OF_LINES = {"x0": ("start", 0), "y0": ("start", 1), "x1": ("end", 0), "y1": ("end", 1)}


def describe_scene(scene: Scene, skills: Sequence[str]) -> dict[str, Any]:
    """What stays the same throughout all episodes: the view, and each group's names and colours."""
    groups, colours = [], colours_of_scene(scene, skills)
    for part in PARTS:
        for index, group in enumerate(getattr(scene, part)):
            about: dict[str, Any] = {"part": part, "arrays": f"{part}{index}"}
            if part == "labels":
                groups.append({**about, "texts": list(group.texts)})
                continue
            kinds = list(getattr(group, "kinds", ()))
            own = colours.get(group.name)
            of_kinds = {kind: both_grounds(colours[kind]) for kind in dict.fromkeys(kinds) if kind in colours}
            about |= {"name": group.name, "states": list(group.states), "kinds": kinds, "ofKinds": of_kinds}
            groups.append({**about, "colour": None if own is None else both_grounds(own)})
    return {"low": list(scene.low), "high": list(scene.high), "groups": groups}


def colours_of_scene(scene: Scene, skills: Sequence[str]) -> dict[str, str]:
    """A colour for each kind of thing, and for each group without kinds; lines have that of text."""
    # Points first, so that theirs are the colours that nothing else has.
    names = [
        word
        for group in (*scene.points, *scene.discs)
        for word in (group.kinds or (group.name,))
        if group.name not in ("agents", "sensors")
    ]
    return colours_of_kinds(names, skills)


def pack_episodes(shown: Shown) -> dict[str, Any]:
    """One seed's episodes: what is said of each, and all of their numbers."""
    recording, lasted = shown.recording, shown.steps
    seen = np.asarray(recording.observation)
    greatest = float(max(np.nan_to_num(np.abs(seen), posinf=0.0).max(initial=0.0), 1e-6))
    choice = np.where(recording.mask[..., None], recording.choice, -1)
    arrays = {
        "choice": choice.transpose(0, 2, 1),
        "seen": _held(_time_last(as_reading(seen, greatest)), lasted - 1),
    }
    if recording.scene is not None:
        arrays |= scene_arrays(recording.scene, lasted)
    solved = [None] * len(lasted) if shown.solved is None else shown.solved.tolist()
    episodes = zip(shown.number.tolist(), solved, short(shown.returns, 6), lasted.tolist(), strict=True)
    return {
        "seed": shown.seed,
        "played": shown.played,
        "episodes": [list(about) for about in episodes],
        "sensors": seen.shape[-1],
        "greatest": greatest,
        **pack(arrays),
    }


def scene_arrays(scene: Scene, lasted: Int[np.ndarray, " episodes"]) -> dict[str, np.ndarray]:
    """Each group's numbers as whole ones, [episodes, things, moments]."""
    arrays: dict[str, np.ndarray] = {}
    corner, extent = scene.low, max(high - low for low, high in zip(scene.low, scene.high, strict=True))
    for part in PARTS:
        for index, group in enumerate(getattr(scene, part)):
            ends = ENDS_OF_LINES if part == "lines" else ENDS
            for axis, (field, column) in ends.items():
                place = np.asarray(getattr(group, field))[..., column]
                arrays[f"{part}{index}.{axis}"] = on_grid(place, corner[column], extent)
            for field, whole in (("heading", as_turn), ("radius", lambda r: on_grid(r, 0.0, extent))):
                if (array := getattr(group, field, None)) is not None:
                    arrays[f"{part}{index}.{field}"] = whole(np.asarray(array))
            if getattr(group, "state", None) is not None:
                arrays[f"{part}{index}.state"] = checked_states(f"{part}[{index}] ({group.name!r})", group)
    return {name: _held(_time_last(array), lasted) for name, array in arrays.items()}


def checked_states(where: str, group: Any) -> np.ndarray:
    """Indices of a group's states, -1 for what is not to be drawn.

    Raises:
        UserError: one of them has no name.
    """
    state = np.asarray(group.state)
    if group.states and state.max(initial=-1) >= len(group.states):
        raise UserError(
            f"scene: {where} has state {state.max()}, and {len(group.states)} names of states "
            f"({', '.join(group.states)}); name it, or keep to those"
        )
    return np.maximum(state, -1)


def _time_last(array: np.ndarray) -> np.ndarray:
    """[episodes, time, things, ...] as [episodes, all things, time]."""
    moved = np.moveaxis(array, 1, -1)
    return moved.reshape(len(moved), -1, moved.shape[-1])


def _held(array: np.ndarray, last: np.ndarray) -> np.ndarray:
    """Keeps what was there last to the end of the array: what comes after an episode costs nothing then."""
    moment = np.arange(array.shape[-1])
    at = np.minimum(moment[None], np.asarray(last)[:, None])
    return np.take_along_axis(array, at[:, None, :], axis=-1)
