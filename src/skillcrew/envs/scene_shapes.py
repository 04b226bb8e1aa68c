"""What is wrong with a scene, in words, before anything is drawn of it."""

import math
from collections.abc import Iterator
from typing import Any

import jax.numpy as jnp

from skillcrew.envs.scene import Discs, Labels, Lines, Points, Scene

PARTS: dict[str, type] = {"points": Points, "discs": Discs, "lines": Lines, "labels": Labels}

ARRAYS: dict[str, tuple[tuple[int, ...], Any]] = {
    "position": ((2,), jnp.floating),
    "start": ((2,), jnp.floating),
    "end": ((2,), jnp.floating),
    "heading": ((), jnp.floating),
    "radius": ((), jnp.floating),
    "state": ((), jnp.integer),
}
"""Of each array of a group of things: its shape behind the axis of things, and its kind of number."""


def scene_mistake(scene: Any, n_agents: int) -> str | None:
    """The first thing that keeps a scene from being drawn, and how to mend it; None if all is well.

    Args:
        scene: what `scene(state)` returned of one world, or its shapes.
        n_agents: how many there have to be where points are called "agents".
    """
    return next(_mistakes(scene, n_agents), None)


def _mistakes(scene: Any, n_agents: int) -> Iterator[str]:
    if not isinstance(scene, Scene):
        yield f"returns {type(scene).__name__}; return a skillcrew.Scene"
        return
    yield from _of_corners(scene)
    for part, kind in PARTS.items():
        groups = getattr(scene, part)
        if not isinstance(groups, tuple):
            yield f"has {part} = {_said(groups)}; give a tuple of skillcrew.{kind.__name__}"
            return
        for index, group in enumerate(groups):
            where = f"{part}[{index}]"
            if not isinstance(group, kind):
                yield f"has {where} = {_said(group)}; give a skillcrew.{kind.__name__}"
                return
            yield from _of_labels(where, group) if part == "labels" else _of_group(where, group, n_agents)


def _of_corners(scene: Scene) -> Iterator[str]:
    for field in ("low", "high"):
        corner = getattr(scene, field)
        numbers = isinstance(corner, tuple) and len(corner) == 2
        if not (numbers and all(isinstance(x, int | float) and math.isfinite(x) for x in corner)):
            yield f"has {field} = {_said(corner)}; give a tuple of two numbers, (x, y)"
            return
    if not all(low < high for low, high in zip(scene.low, scene.high, strict=True)):
        yield f"has high = {scene.high} and low = {scene.low}; make high the greater one in x and y"


def _of_group(where: str, group: Any, n_agents: int) -> Iterator[str]:
    """The arrays are of one length, and what is said of them too."""
    if not isinstance(group.name, str):
        yield f"has {where}.name = {_said(group.name)}; give a word"
        return
    for field in ("states", "kinds"):
        words = getattr(group, field, ())
        if not (isinstance(words, tuple) and all(isinstance(word, str) for word in words)):
            yield f"has {where}.{field} = {_said(words)}; give a tuple of words"
            return
    where = f"{where} ({group.name!r})"
    things = None
    for field, (behind, kind) in ARRAYS.items():
        array = getattr(group, field, None)
        if array is None:
            continue
        shape = getattr(array, "shape", None)
        if things is None and shape is not None and len(shape) == 1 + len(behind):
            things = shape[0]
        wanted = (things if things is not None else "things", *behind)
        if shape != wanted:
            yield f"has {where} with {field} {_said(array)}; make it of the shape {_shape(wanted)}"
            return
        if not jnp.issubdtype(array.dtype, kind):
            word = "whole numbers" if kind is jnp.integer else "floating-point numbers"
            yield f"has {where} with {field} of {array.dtype}; make it {word}"
    if group.name == "agents" and isinstance(group, Points) and things != n_agents:
        yield f"has {where} with {things} things, for {n_agents} agents; give one for each, or another name"
    if getattr(group, "kinds", ()) and len(group.kinds) != things:
        yield f"has {where} with {len(group.kinds)} kinds, for {things} things; give one for each, or none"


def _of_labels(where: str, labels: Labels) -> Iterator[str]:
    texts, shape = labels.texts, getattr(labels.position, "shape", None)
    if not (isinstance(texts, tuple) and all(isinstance(text, str) for text in texts)):
        yield f"has {where}.texts = {_said(texts)}; give a tuple of words"
    elif shape != (len(texts), 2):
        wanted = _shape((len(texts), 2))
        yield f"has {where} with position {_said(labels.position)}; make it of the shape {wanted}"


def _said(value: Any) -> str:
    shape = getattr(value, "shape", None)
    return repr(value) if shape is None else f"of the shape {_shape(shape)}"


def _shape(shape: tuple[Any, ...]) -> str:
    return f"({', '.join(map(str, shape))}{',' if len(shape) == 1 else ''})"
