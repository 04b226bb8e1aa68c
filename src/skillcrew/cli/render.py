"""`skillcrew render RUN`."""

import dataclasses
import functools
import json
from pathlib import Path

from skillcrew.analysis.film.episode import episode_of
from skillcrew.analysis.film.write import FilmConfig, check_name, write_episode
from skillcrew.cli.options import parse_options
from skillcrew.cli.present import take_places
from skillcrew.experiment.progress import tracked
from skillcrew.experiment.run import Run

USAGE = (
    "usage: skillcrew render RUN [OPTIONS]\n\n"
    "RUN  the folder of a run\n\n"
    "Makes a film of one episode of a champion, or a picture of one moment of it. Episodes are those of the\n"
    "run's page, by the same numbers."
)


@dataclasses.dataclass(frozen=True)
class RenderOptions(FilmConfig):
    """Options of `skillcrew render`."""

    out: Path | None = None
    """File to write: a film (.gif, .mp4) or a picture (.png, .svg).
    Default: a film in the run's report/, or with --time a picture."""
    seed: int | None = None
    """Whose champion plays. Default: the run's first seed."""
    episode: str | None = None
    """fastest, slowest, solved or failed (best or worst, where nothing says what success is), or a number.
    Default: the fastest or best."""
    time: int | None = None
    """Time step of which a picture is drawn. Default: the last one."""
    checkpoint: int | None = None
    """Generation whose champion plays. Default: the latest checkpoint."""
    trust: bool = False
    """Import the environment's class from wherever the folder says: that runs its code."""
    quiet: bool = False
    """Say nothing while frames are drawn."""
    json: bool = False
    """Print one JSON object with the file and the episode, and nothing else."""


def run(words: list[str]) -> int:
    """Writes the film or the picture, and says where it is."""
    places = take_places(words, ("RUN",), USAGE)
    if places is None:
        parse_options(RenderOptions, ["--help"], RenderOptions(), "skillcrew render RUN", USAGE)
        return 0
    program = f"skillcrew render {words[0]}"
    options = parse_options(RenderOptions, words[1:], RenderOptions(), program, USAGE)
    if options.out is not None:
        check_name(options.out, options.time)
    trained = Run(places[0], checkpoint=options.checkpoint, trust=options.trust)
    episode = episode_of(trained, options.seed, options.episode)
    out = options.out
    if out is None:
        trained.folder.check_own()
        ending = ".mp4" if options.time is None else f"_step_{options.time}.png"
        out = trained.folder.report / f"seed_{episode.seed}_episode_{episode.number}{ending}"
    watch = functools.partial(tracked, word="drawing", quiet=options.quiet)
    write_episode(episode, out, options, options.time, watch)
    found = {"written": str(out), "seed": episode.seed, "episode": episode.number, "steps": episode.steps}
    found |= {"outcome": episode.outcome}
    print(json.dumps(found, indent=1) if options.json else f"{out}")
    return 0
