"""`skillcrew report RUN [RUN …]`."""

import dataclasses
import itertools
import json
from pathlib import Path

from skillcrew.analysis.report import write_report, write_reports
from skillcrew.cli.options import parse_options
from skillcrew.cli.present import take_places
from skillcrew.errors import UserError
from skillcrew.experiment.run import Run

USAGE = (
    "usage: skillcrew report RUN [RUN …] [OPTIONS]\n\n"
    "RUN  the folder of a run\n\n"
    "Writes a page, report.html, that opens in any browser: learning curves, a replay of the champions'\n"
    "episodes, who chose which skill when, configuration. Beside it, as PNG and PDF, the learning curve\n"
    "with its 95 % band over seeds and, for each seed and agent, which skills the champion chose at each\n"
    "time step. Of several runs there is one page, and a folder of figures each."
)

FOLDER = Path("report")
"""Of the page of several runs."""


@dataclasses.dataclass(frozen=True)
class ReportOptions:
    """Options of `skillcrew report`."""

    out: Path | None = None
    """Folder for the page and the figures. Default: report/ in the run's folder; of several runs, report/
    where you are."""
    episodes: int = 1000
    """Fresh episodes whose choices are drawn."""
    checkpoint: int | None = None
    """Generation whose champions are drawn, of one run. Default: the latest checkpoint."""
    trust: bool = False
    """Import the environment's class from wherever the folder says: that runs its code."""
    json: bool = False
    """Print one JSON object with the files written, and nothing else."""


def run(words: list[str]) -> int:
    """Writes the page and the figures, and says where they are."""
    places = take_places(words, ("RUN",), USAGE)
    if places is None:
        parse_options(ReportOptions, ["--help"], ReportOptions(), ("report", "RUN"), USAGE)
        return 0
    folders = list(itertools.takewhile(lambda word: not word.startswith("-"), words))
    rest = words[len(folders) :]
    options = parse_options(ReportOptions, rest, ReportOptions(), ("report", words[0]), USAGE)
    if options.checkpoint is not None and len(folders) > 1:
        raise UserError(f"--checkpoint {options.checkpoint}: is of one run; give one RUN, or leave it out")
    runs = [Run(folder, checkpoint=options.checkpoint, trust=options.trust) for folder in folders]
    evaluations = [one.evaluate(options.episodes) for one in runs]
    if len(runs) > 1:
        paths = write_reports(runs, evaluations, options.out or FOLDER)
    else:
        paths = write_report(runs[0], evaluations[0], options.out)
    written = [str(path) for path in paths]
    print(json.dumps({"written": written}, indent=1) if options.json else "\n".join(written))
    return 0
