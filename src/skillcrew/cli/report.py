"""`skillcrew report RUN`."""

import dataclasses
import json
from pathlib import Path

from skillcrew.analysis.report import write_report
from skillcrew.cli.options import parse_options
from skillcrew.cli.present import take_places
from skillcrew.experiment.run import Run

USAGE = (
    "usage: skillcrew report RUN [OPTIONS]\n\n"
    "RUN  the folder of a run\n\n"
    "Draws the learning curve with its 95 % band over seeds and, for each seed and agent, which skills the\n"
    "champion chose at each time step of its episodes, as PNG and PDF."
)


@dataclasses.dataclass(frozen=True)
class ReportOptions:
    """Options of `skillcrew report`."""

    out: Path | None = None
    """Folder for the figures. Default: report/ in the run's folder."""
    episodes: int = 1000
    """Fresh episodes whose choices are drawn."""
    checkpoint: int | None = None
    """Generation whose champions are drawn. Default: the latest checkpoint."""
    trust: bool = False
    """Import the environment's class from wherever the folder says: that runs its code."""
    json: bool = False
    """Print one JSON object with the files written, and nothing else."""


def run(words: list[str]) -> int:
    """Writes the figures and says where they are."""
    places = take_places(words, ("RUN",), USAGE)
    if places is None:
        parse_options(ReportOptions, ["--help"], ReportOptions(), "skillcrew report RUN", USAGE)
        return 0
    options = parse_options(ReportOptions, words[1:], ReportOptions(), f"skillcrew report {words[0]}", USAGE)
    reported = Run(places[0], checkpoint=options.checkpoint, trust=options.trust)
    written = [str(path) for path in write_report(reported, reported.evaluate(options.episodes), options.out)]
    print(json.dumps({"written": written}, indent=1) if options.json else "\n".join(written))
    return 0
