"""`skillcrew reproduce FIGURE`."""

import dataclasses
import textwrap
from collections.abc import Iterable
from pathlib import Path

from skillcrew.cli.arguments import Seeds
from skillcrew.cli.options import parse_options
from skillcrew.cli.present import take_places
from skillcrew.cli.side_by_side import run_side_by_side
from skillcrew.experiment import reproduction
from skillcrew.experiment.figures import FIGURES, environments, figures_of


def _listed(start: str, names: Iterable[str], end: str = "") -> str:
    """Names with commas between, in lines that are indented like what stands above them."""
    text = f"{start}{', '.join(names)}{end}"
    indent = 8 * " "
    return textwrap.fill(text, 104, initial_indent=indent, subsequent_indent=indent, break_on_hyphens=False)


USAGE = (
    "usage: skillcrew reproduce FIGURE [OPTIONS]\n\n"
    "FIGURE  all       what the MADyS thesis compares, MADyS, MFL and EA in its form, beside our best form,\n"
    "                  the one before it, and timetables that sense nothing\n"
    "        frontier  more types, more rovers, and tasks that ask a team to look or to split\n"
    "        domains   search and rescue, and the warehouse: teams that choose while they look\n"
    "        rivals    ours beside MAPPO, IPPO, COMA and LIIR over the same skills, and beside\n"
    "                  MAPPO, MADDPG and MATD3 that choose none\n"
    f"{_listed('or one of ', FIGURES, '; or one environment of theirs:')}\n"
    f"{_listed('', environments())}\n\n"
    "Trains with the thesis's five seeds, and ends in figures, a table, and every run's configuration. Can\n"
    "be interrupted at any time: the same command goes on where it was."
)

DEFAULT_SEEDS = Seeds(reproduction.SEEDS)


@dataclasses.dataclass(frozen=True)
class ReproduceOptions:
    """Options of `skillcrew reproduce`."""

    out: Path = Path("runs/reproduction")
    """Folder for runs and results; one that was begun is gone on with."""
    budget: float = 1.0
    """Share of the full number of environment steps, and of the time that skills are given to learn: 0.02 for
    a quick look, whose figures mean nothing."""
    seeds: Seeds = DEFAULT_SEEDS
    """How many runs (5: seeds 0 to 4), or which (2000..2004); all in one program."""
    jobs: int | None = None
    """Runs side by side, each on its share of the cores. Default: one per core, or one on a GPU."""
    so_far: bool = False
    """Trains nothing: figures and tables of the runs that are finished."""


def run(words: list[str]) -> int:
    """Trains what is missing, then writes figures and tables; 130 if interrupted after saving."""
    places = take_places(words, ("FIGURE",), USAGE)
    if places is None:
        parse_options(ReproduceOptions, ["--help"], ReproduceOptions(), ("reproduce", "FIGURE"), USAGE)
        return 0
    figures = figures_of(places[0])
    options = parse_options(ReproduceOptions, words[1:], ReproduceOptions(), ("reproduce", places[0]), USAGE)
    comparison = reproduction.reproduction(figures, tuple(options.seeds), options.budget)
    again = ["reproduce", *words]
    return run_side_by_side(comparison, options.out, options.jobs, again, so_far=options.so_far)
