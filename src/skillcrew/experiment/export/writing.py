"""A run's champion as a folder from which it acts without skillcrew."""

import importlib.util
import json
import os
import shutil
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import safetensors.numpy
from jaxtyping import PyTree

from skillcrew.errors import Notice, UserError, unknown_name
from skillcrew.experiment.export import description
from skillcrew.experiment.export.interface import NEXT, Interface, initial_memory, observation_of
from skillcrew.experiment.export.onnx_model import imported, onnx_model
from skillcrew.experiment.export.program import Program
from skillcrew.experiment.export.stablehlo import stablehlo
from skillcrew.experiment.export.structure import taken_apart
from skillcrew.experiment.export.tracing import program_of
from skillcrew.experiment.files import disk_errors
from skillcrew.experiment.run import Run

ACTING = {"safetensors": "act_numpy.py", "stablehlo": "act_stablehlo.py", "onnx": "act_onnx.py"}
"""The program that is written beside each format."""

FORMATS = tuple(ACTING)


def export_team(
    run: Run, out: Path | str, seed: int | None = None, formats: Sequence[str] | None = None
) -> list[Path]:
    """Writes the champion of one seed into a new folder, whole or not at all; see `docs/export.md`.

    Args:
        seed: by default the run's first.
        formats: among "safetensors", "stablehlo" and "onnx"; by default all, the last where the package onnx
            is installed.

    Returns:
        The files.

    Raises:
        UserError: an existing folder, one that cannot be written, an unknown seed or format, a run without a
            checkpoint, or the package onnx is missing.
    """
    folder = Path(out)
    if os.path.lexists(folder):
        raise UserError(f"{folder}: exists and is never overwritten; choose another folder with --out")
    formats = _checked(formats)
    seed = run.config.seeds[0] if seed is None else seed
    about = description.origin(run, seed)
    files = files_of(run.champion(seed), observation_of(run.algorithm.env), about, formats)
    filling = folder.with_name(f".{folder.name}.{os.getpid()}")
    try:
        with disk_errors(folder):
            filling.mkdir(parents=True)
            for name, data in files.items():
                (filling / name).write_bytes(data)
            filling.rename(folder)
    finally:
        shutil.rmtree(filling, ignore_errors=True)
    return [folder / name for name in files]


def _checked(formats: Sequence[str] | None) -> tuple[str, ...]:
    """The formats to write, each once."""
    if formats is None:
        if importlib.util.find_spec("onnx"):
            return FORMATS
        warnings.warn(
            Notice("onnx is left out: pip install 'skillcrew[onnx]' brings the package it needs"),
            stacklevel=3,
        )
        return tuple(name for name in FORMATS if name != "onnx")
    for name in formats:
        if name not in FORMATS:
            raise unknown_name("format", name, FORMATS)
    if not formats:
        raise UserError(f"formats: give at least one of {', '.join(FORMATS)}")
    if "onnx" in formats:
        imported()
    return tuple(dict.fromkeys(formats))


def files_of(
    team: Any, observation: PyTree, about: Mapping[str, Any], formats: Sequence[str]
) -> dict[str, bytes]:
    """What the folder of a team holds, by name.

    Args:
        observation: its shapes.
        about: what else its description says.
    """
    structure, weights = taken_apart(team)
    interface = Interface.of(team, observation)
    program = program_of(team, weights, interface)
    memory = zip(interface.memory, initial_memory(team), strict=True)
    start = {port.name: array for port, array in memory}
    said = {**about, **description.ports_in_words(interface, start, program.draws)}
    files: dict[str, bytes] = {}
    if "safetensors" in formats:
        tensors = safetensors.numpy.save(_tensors(weights, program, start))
        files |= {description.TENSORS: tensors, description.PROGRAM: _as_json(program)}
        said |= {"sha256": description.digest(tensors, structure), "policy": structure}
    if "stablehlo" in formats:
        files[description.STABLEHLO] = stablehlo(team, interface, bool(program.draws))
    if "onnx" in formats:
        files[description.ONNX] = onnx_model(program)
    acting = Path(__file__).with_name("acting")
    files |= {ACTING[name]: (acting / ACTING[name]).read_bytes() for name in formats}
    return {description.DESCRIPTION: description.as_text(said).encode(), **files}


def _tensors(
    weights: Mapping[str, np.ndarray], program: Program, start: Mapping[str, np.ndarray]
) -> dict[str, np.ndarray]:
    """All arrays of a team, of its program, and what is remembered at the start."""
    every = {**weights, **program.constants, **start}
    return {name: np.ascontiguousarray(array).reshape(array.shape) for name, array in every.items()}


def _as_json(program: Program) -> bytes:
    """A node a line."""
    nodes = ",\n".join(
        json.dumps([node.word, node.inputs, node.attributes, node.output], default=int)
        for node in program.nodes
    )
    results = json.dumps({name.removeprefix(NEXT): value for name, value in program.results.items()})
    return f'{{"nodes": [\n{nodes}\n], "results": {results}}}\n'.encode()
