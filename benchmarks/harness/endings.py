"""What a run ended with, as far as another must end with the same bits."""

import hashlib
from collections.abc import Mapping
from pathlib import Path

import numpy as np

import skillcrew as sc
from skillcrew.experiment.checkpoints import Checkpoints
from skillcrew.experiment.generation import shapes


def ending(folder: Path) -> dict[str, np.ndarray]:
    """All columns of the metrics, where they are not lost, and all arrays of the last checkpoint, by name."""
    run = sc.Run(folder)
    arrays, _ = Checkpoints(run.folder.checkpoints).read(shapes(run.algorithm, run.config))
    metrics = run.metrics() if run.folder.metrics.exists() else {}
    columns = {f"metrics: {name}": values for name, values in metrics.items()}
    return columns | {name: np.asarray(array) for name, array in arrays.items()}


def same(one: np.ndarray, other: np.ndarray) -> bool:
    """Whether two arrays are equal to the bit; NaN equals NaN."""
    floats = one.dtype.kind == "f"
    return one.dtype == other.dtype and np.array_equal(one, other, equal_nan=floats)


def digests(arrays: Mapping[str, np.ndarray]) -> dict[str, str]:
    """A digest of each array, which two have in common exactly if they are the `same`."""
    return {name: _digest(array) for name, array in arrays.items()}


def _digest(array: np.ndarray) -> str:
    if array.dtype.kind == "f":
        # Zeros differ in their sign, and NaN in much, without being different.
        array = np.where(np.isnan(array), np.nan, array) + np.zeros((), array.dtype)
    about = f"{array.dtype} {array.shape}".encode()
    return hashlib.sha256(about + np.ascontiguousarray(array).tobytes()).hexdigest()
