"""Reading an exported team back: from numbers and plain values alone, none of which is ever run."""

from pathlib import Path
from typing import Any

import jax.numpy as jnp
import safetensors
import safetensors.numpy

from skillcrew.errors import UserError
from skillcrew.experiment.export.description import (
    DESCRIPTION,
    TENSORS,
    damaged,
    digest,
    interface_in,
    read_description,
)
from skillcrew.experiment.export.fitting import check_fits
from skillcrew.experiment.export.structure import put_together, shapes_in
from skillcrew.policies.team import Team
from skillcrew.policies.team_by_type import TeamByType

LARGEST_FILE = 2**31
"""Bytes."""


def load_team(folder: Path | str) -> Team | TeamByType:
    """The team that `skillcrew export` wrote, which acts to the same bits.

    Reads `team.json` and `team.safetensors`, and runs no code of the folder.

    Raises:
        UserError: no such folder, damaged, of a newer skillcrew, or what it says does not fit together.
    """
    folder = Path(folder)
    description, tensors = read_description(folder), folder / TENSORS
    try:
        if "policy" not in description:
            raise UserError("policy: is missing; export the team with safetensors among its formats")
        shapes = shapes_in(description["policy"])
        check_fits(description["policy"], shapes, interface_in(description))
    except UserError as error:
        raise UserError(f"{folder / DESCRIPTION}: {error}") from error
    if not tensors.is_file():
        raise UserError(f"{tensors}: missing; export the team again, or restore the file")
    _check_shapes(tensors, shapes)
    data = tensors.read_bytes()
    if digest(data, description["policy"]) != description.get("sha256"):
        raise damaged(tensors, f", or {DESCRIPTION} is")
    arrays = safetensors.numpy.load(data)
    return put_together(description["policy"], {name: jnp.asarray(arrays[name]) for name in shapes})


def _check_shapes(path: Path, shapes: dict[str, Any]) -> None:
    """Compares what a file says that it holds with what it should hold, before anything is read of it.

    Raises:
        UserError: another shape or type, an array that is missing, or the file is cut off.
    """
    if path.stat().st_size > LARGEST_FILE:
        raise UserError(f"{path}: is larger than any team")
    try:
        with safetensors.safe_open(path, framework="numpy") as file:
            found = {name: file.get_slice(name) for name in file.keys()}  # noqa: SIM118
            said = {name: (tuple(one.get_shape()), one.get_dtype()) for name, one in found.items()}
    except (safetensors.SafetensorError, OSError) as error:
        raise damaged(path, f" or cut off ({error})") from error
    for name, shape in shapes.items():
        wanted = tuple(shape.shape), DTYPES[str(shape.dtype)]
        if said.get(name) != wanted:
            raise UserError(
                f"{path}: {name} is {said.get(name, 'missing')}, and {DESCRIPTION} asks for {wanted}; export "
                "the team again"
            )


DTYPES = {"float32": "F32", "int32": "I32", "bool": "BOOL"}
"""In safetensors' words."""
