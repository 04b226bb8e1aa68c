"""What `team.json` says of an exported team, and reading it back."""

import hashlib
import importlib.metadata
import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from skillcrew.envs.registry import place_of
from skillcrew.errors import UserError
from skillcrew.experiment.export.interface import Interface, Port
from skillcrew.experiment.export.structure import shape_of
from skillcrew.experiment.files import read_plain
from skillcrew.experiment.run import Run

FORMAT = 1
"""Version of the layout, and of what policies are made of; of a newer one nothing is read."""

DESCRIPTION = "team.json"
TENSORS = "team.safetensors"
PROGRAM = "program.json"
STABLEHLO = "team.stablehlo"
ONNX = "team.onnx"


def origin(run: Run, seed: int) -> dict[str, Any]:
    """Where a champion comes from: which skillcrew, environment, algorithm and seed."""
    algorithm, env = run.algorithm, run.algorithm.env
    described, place = env.describe(), place_of(env)
    return {
        "format": FORMAT,
        "skillcrew": importlib.metadata.version("skillcrew"),
        "environment": described if place is None else {**described, "class": place},
        "algorithm": algorithm.name,
        "seed": seed,
        "agents": env.n_agents,
        "observation_size": env.observation_size,
        "action_size": env.action_size,
        "actions": env.actions,
        "skills": list(algorithm.choices()),
    }


def ports_in_words(
    interface: Interface, start: Mapping[str, np.ndarray], draws: tuple[Port, ...]
) -> dict[str, Any]:
    """What goes in and comes out, by name, and what is remembered at the start of an episode."""
    memory = [{**_plain(port), "start": start[port.name].tolist()} for port in interface.memory]
    return {
        "observation": list(map(_plain, interface.observation)),
        "memory": memory,
        "draws": list(map(_plain, draws)),
        "outputs": list(map(_plain, interface.outputs)),
    }


def as_text(description: Mapping[str, Any]) -> str:
    """JSON, with each row of numbers and each array on one line."""
    text = json.dumps(description, indent=1, ensure_ascii=False, default=str)
    for short in (r"\[\n[^\[\]{}]*\]", r'\{\n\s*("name": [^\n]*\n\s*)?"shape"[^{}]*\}'):
        text = re.sub(short, lambda found: re.sub(r"\n\s*", " ", found[0]), text)
    return text + "\n"


def read_description(folder: Path) -> dict[str, Any]:
    """What an exported folder says of itself.

    Raises:
        UserError: no such folder, damaged, or of a newer skillcrew.
    """
    path = folder / DESCRIPTION
    if not path.is_file():
        raise UserError(f"{folder}: no exported team (it has no {DESCRIPTION}); `skillcrew export` makes one")
    try:
        found = json.loads(read_plain(path))
    except (OSError, ValueError, RecursionError):
        raise damaged(path) from None
    version = found.get("format") if isinstance(found, dict) else None
    if isinstance(version, bool) or not isinstance(version, int):
        raise damaged(path)
    if version > FORMAT:
        raise UserError(
            f"{path}: written by a newer skillcrew (team format {version}, this one reads {FORMAT}); upgrade "
            "skillcrew"
        )
    return found


def interface_in(description: Mapping[str, Any]) -> Interface:
    """What a team says that it sees, remembers and does.

    Raises:
        UserError: it does not say so; the line names the place.
    """
    return Interface(*(_ports(description, place) for place in ("observation", "memory", "outputs")))


def digest(tensors: bytes, policy: Any) -> str:
    """SHA-256 of all that a team is made of, by which damage is noticed."""
    return hashlib.sha256(json.dumps(policy, sort_keys=True).encode() + tensors).hexdigest()


def damaged(path: Path, how: str = "") -> UserError:
    """That a file of a team is not as it was written."""
    return UserError(f"{path}: damaged{how}; export the team again, or restore the file")


def _plain(port: Port) -> dict[str, Any]:
    return {"name": port.name, "shape": list(port.shape), "dtype": port.dtype}


def _ports(description: Mapping[str, Any], place: str) -> tuple[Port, ...]:
    listed = description.get(place)
    if not isinstance(listed, list):
        raise UserError(f"{place}: needs a list of arrays")
    ports = []
    for one in listed:
        if not isinstance(one, dict) or not isinstance(one.get("name"), str):
            raise UserError(f"{place}: each array needs a name")
        shape = shape_of({key: one.get(key) for key in ("shape", "dtype")}, one["name"])
        ports.append(Port(one["name"], shape.shape, str(shape.dtype)))
    return tuple(ports)
