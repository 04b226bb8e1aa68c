"""Lets many runs with one configuration share what JAX traces and compiles: it takes most of their time."""

import contextlib
import os
from collections.abc import Callable, Generator
from pathlib import Path
from typing import Any
from unittest import mock

import jax

from skillcrew.experiment import config, generation, memory
from skillcrew.experiment.run import Run


@contextlib.contextmanager
def shared_programs() -> Generator[None]:
    """Files of the same bytes give the same objects, and these the same programs."""
    read, compiled = config.from_yaml, generation.compiled
    shapes, estimate = generation.shapes, memory.estimate
    configurations: dict[Any, Any] = {}
    programs: dict[Any, Callable[..., Any]] = {}

    def from_yaml(path: Path, env: Any = None, trust: bool = False) -> Any:
        if not os.path.isfile(path):
            return read(path, env, trust)
        try:
            key = path.read_bytes(), env, trust
        except OSError:
            return read(path, env, trust)
        # The path is part of what an error says; there is none once it has been read.
        if key not in configurations:
            configurations[key] = read(path, env, trust)
        return configurations[key]

    def compile_once(function: Callable[..., Any], *arguments: Any, **options: Any) -> Callable[..., Any]:
        cells = tuple(cell.cell_contents for cell in function.__closure__ or ())
        leaves, structure = jax.tree.flatten(arguments)
        key = (
            "compiled",
            getattr(function, "__wrapped__", function).__code__,
            tuple(map(_identity, cells)),
            tuple((leaf.shape, str(leaf.dtype)) for leaf in leaves),
            structure,
        )
        if key not in programs:
            programs[key] = compiled(function, *arguments, **options)
        return programs[key]

    def once(function: Callable[..., Any]) -> Callable[..., Any]:
        def remembered(algorithm: Any, of: Any) -> Any:
            key = function, id(algorithm), of
            if key not in programs:
                programs[key] = function(algorithm, of)
            return programs[key]

        return remembered

    with (
        mock.patch("skillcrew.experiment.run.from_yaml", from_yaml),
        mock.patch("skillcrew.cli.train.from_yaml", from_yaml),
        mock.patch.object(generation, "compiled", compile_once),
        mock.patch.object(generation, "shapes", once(shapes)),
        mock.patch.object(memory, "estimate", once(estimate)),
    ):
        yield


def _identity(value: Any) -> Any:
    """What a program depends on of something that its function refers to."""
    if isinstance(value, Run):
        return id(value.algorithm)
    if callable(value) and getattr(value, "__closure__", None):
        return value.__code__, tuple(_identity(cell.cell_contents) for cell in value.__closure__)
    try:
        hash(value)
    except TypeError:
        return id(value)
    return value
