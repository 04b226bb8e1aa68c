"""`skillcrew export RUN`."""

import dataclasses
import json
from pathlib import Path

from skillcrew.cli.options import parse_options
from skillcrew.cli.present import take_places
from skillcrew.experiment.export.writing import export_team
from skillcrew.experiment.run import Run

USAGE = (
    "usage: skillcrew export RUN [OPTIONS]\n\n"
    "RUN  the folder of a run\n\n"
    "Writes the champion of one seed into a folder from which it acts without skillcrew, with a program of\n"
    "30 lines for each format: safetensors (NumPy), StableHLO (JAX), ONNX (ONNX Runtime). In Python,\n"
    "sc.load_team reads it back."
)


@dataclasses.dataclass(frozen=True)
class ExportOptions:
    """Options of `skillcrew export`."""

    out: Path = Path("team")
    """A folder that does not exist yet."""
    seed: int | None = None
    """Whose champion. Default: the run's first seed."""
    formats: str | None = None
    """One or more of safetensors,stablehlo,onnx. Default: all, ONNX where the package onnx is installed."""
    checkpoint: int | None = None
    """Generation whose champion is written. Default: the latest checkpoint."""
    trust: bool = False
    """Import the environment's class from wherever the folder says: that runs its code."""
    json: bool = False
    """Print one JSON object with the files written, and nothing else."""


def run(words: list[str]) -> int:
    """Writes the folder, and says what is in it."""
    places = take_places(words, ("RUN",), USAGE)
    if places is None:
        parse_options(ExportOptions, ["--help"], ExportOptions(), "skillcrew export RUN", USAGE)
        return 0
    options = parse_options(ExportOptions, words[1:], ExportOptions(), f"skillcrew export {words[0]}", USAGE)
    formats = None if options.formats is None else [word.strip() for word in options.formats.split(",")]
    source = Run(places[0], checkpoint=options.checkpoint, trust=options.trust)
    written = [str(path) for path in export_team(source, options.out, options.seed, formats)]
    print(json.dumps({"written": written}, indent=1) if options.json else "\n".join(written))
    return 0
