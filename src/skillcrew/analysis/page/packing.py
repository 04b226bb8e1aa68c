"""Numbers as short text: as fine as a screen shows them, differences over time, deflated, base64."""

import base64
import json
import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np
from jaxtyping import Float, Int, Int16, Num

STEPS_ACROSS = 4000
"""Positions across what a scene shows; more than a screen has pixels for it."""

STEPS_AROUND = 256
"""Headings."""

STEPS_OF_SENSORS = 100
"""Of what an agent senses, on a logarithmic scale from 0 to the greatest magnitude."""

NOWHERE = -32768
"""Stands for a number that is none."""


def pack(arrays: Mapping[str, Num[np.ndarray, "..."]]) -> dict[str, Any]:
    """Arrays of small whole numbers, time last, as JSON can hold them.

    Returns:
        "arrays": name and shape of each, in order; "data": the differences along the last axis, modulo 2^16,
        of all arrays in a row, the low bytes of all before the high bytes, deflated, as base64.
    """
    differences = [_differences(array).ravel() for array in arrays.values()]
    joined = np.concatenate(differences) if differences else np.zeros(0, np.uint16)
    # What moves little has high bytes that are nearly all alike, and these deflate to nothing.
    planes = np.concatenate([joined & 0xFF, joined >> 8]).astype(np.uint8)
    return {
        "arrays": [[name, list(array.shape)] for name, array in arrays.items()],
        "data": base64.b64encode(zlib.compress(planes.tobytes(), 9)).decode("ascii"),
    }


def unpack(packed: Mapping[str, Any]) -> dict[str, Int16[np.ndarray, "..."]]:
    """The inverse of `pack`: what the page's script does, in NumPy."""
    planes = np.frombuffer(zlib.decompress(base64.b64decode(packed["data"])), np.uint8).astype(np.uint16)
    low, high = np.split(planes, 2)
    joined, arrays, first = low | (high << 8), {}, 0
    for name, shape in packed["arrays"]:
        size = int(np.prod(shape))
        part = joined[first : first + size].reshape(shape)
        arrays[name] = np.cumsum(part, axis=-1, dtype=np.uint16).view(np.int16)
        first += size
    return arrays


def _differences(array: Num[np.ndarray, "..."]) -> np.ndarray:
    whole = array.astype(np.int64).astype(np.uint16)
    return np.diff(whole, axis=-1, prepend=np.zeros_like(whole[..., :1]))


def on_grid(
    coordinate: Float[np.ndarray, "*any"], low: float | int, extent: float | int
) -> Int[np.ndarray, "*any"]:
    """Places as steps from `low`, `STEPS_ACROSS` to `extent`; what is no number is `NOWHERE`."""
    # What is further away is drawn nowhere in any case, but must not become a place that is.
    far = -(NOWHERE + 1) / STEPS_ACROSS * extent
    near = np.clip(np.nan_to_num(coordinate, nan=0.0, posinf=np.inf, neginf=-np.inf), low - far, low + far)
    steps = np.rint((near.astype(float) - low) / extent * STEPS_ACROSS).astype(int)
    return np.where(np.isnan(coordinate), NOWHERE, steps)


def as_turn(angle: Float[np.ndarray, "*any"]) -> Int[np.ndarray, "*any"]:
    """Angles in radians as one of `STEPS_AROUND` directions."""
    turns = np.nan_to_num(angle, nan=0.0, posinf=0.0, neginf=0.0) / (2 * np.pi)
    return np.rint(turns * STEPS_AROUND).astype(int) % STEPS_AROUND


def as_reading(value: Float[np.ndarray, "*any"], greatest: float) -> Int[np.ndarray, "*any"]:
    """Readings of sensors as steps of log(1 + |x|), with the sign of x.

    Args:
        greatest: magnitude that the last step stands for.
    """
    sound = np.nan_to_num(value, nan=0.0, posinf=greatest, neginf=-greatest)
    share = np.log1p(np.minimum(np.abs(sound), greatest)) / np.log1p(greatest)
    return (np.sign(sound) * np.rint(share * STEPS_OF_SENSORS)).astype(int)


def short(values: Num[np.ndarray, "*any"], digits: int = 4) -> list[Any]:
    """Numbers with so many digits in all; None for what is no number."""
    return [json.loads(f"{value:.{digits}g}") if np.isfinite(value) else None for value in np.ravel(values)]
