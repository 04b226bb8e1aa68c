"""`skillcrew studio RUNS`."""

import dataclasses
from pathlib import Path

from skillcrew.analysis.studio.serve import serve
from skillcrew.cli.options import parse_options
from skillcrew.cli.present import take_places
from skillcrew.errors import UserError

USAGE = (
    "usage: skillcrew studio RUNS [OPTIONS]\n\n"
    "RUNS  a folder with runs below it, such as runs/\n\n"
    "Shows runs in the browser, live: how far each is and what it reached, curves that grow while they\n"
    "train, the page of each, and the curves of any of them in one figure. Only this machine can look\n"
    "unless --host says otherwise, and nothing is changed. Ctrl-C ends it."
)


@dataclasses.dataclass(frozen=True)
class StudioOptions:
    """Options of `skillcrew studio`."""

    port: int = 8000
    """Where it listens; 0 takes any that is free."""
    host: str = "127.0.0.1"
    """Name or address at which it listens. Beyond 127.0.0.1, whoever reaches this machine can look."""
    open: bool = False
    """Open it in this machine's browser at once."""

    def __post_init__(self) -> None:
        if not 0 <= self.port < 2**16:
            raise UserError(f"--port {self.port}: give a number from 0 to {2**16 - 1}")


def run(words: list[str]) -> int:
    """Serves until Ctrl-C."""
    places = take_places(words, ("RUNS",), USAGE)
    if places is None:
        parse_options(StudioOptions, ["--help"], StudioOptions(), ("studio", "RUNS"), USAGE)
        return 0
    options = parse_options(StudioOptions, words[1:], StudioOptions(), ("studio", words[0]), USAGE)
    serve(Path(places[0]), options.host, options.port, options.open)
    return 0
