"""An episode as a file: a film, or one picture of it."""

import dataclasses
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import matplotlib
import numpy as np
from jaxtyping import Float

from skillcrew.analysis.canvas import STYLE
from skillcrew.analysis.film.episode import Episode
from skillcrew.analysis.film.ffmpeg import Frame, write_gif, write_mp4
from skillcrew.analysis.film.picture import Picture
from skillcrew.errors import UserError
from skillcrew.experiment.files import disk_errors, write_whole

FILMS, PICTURES = (".gif", ".mp4"), (".png", ".svg")

HOLD = 1.5
"""Seconds for which a film stands still at its end."""

SAMPLES = 12
"""Frames from which the colours of a GIF are chosen."""


@dataclasses.dataclass(frozen=True)
class FilmConfig:
    """How a film looks."""

    size: int = 720
    """Width in pixels; the height follows from the shape of the world."""
    fps: int = 20
    """Frames of a film per second; between two time steps things are on the straight line between them."""
    speed: int = 5
    """Time steps of the episode per second of a film."""

    def __post_init__(self) -> None:
        for name, least, most in (("size", 320, 4096), ("fps", 1, 60), ("speed", 1, 100)):
            if not least <= getattr(self, name) <= most:
                raise UserError(f"{name} = {getattr(self, name)}: give a number from {least} to {most}")


def check_name(path: Path, time: int | None) -> None:
    """Says what is wrong with the name of a file before anything is played.

    Raises:
        UserError: it names no kind of file that can be written, or a film of one moment.
    """
    if path.suffix.lower() not in (*FILMS, *PICTURES):
        raise UserError(f"--out {path}: give a name that ends in {', '.join((*FILMS, *PICTURES))}")
    if path.is_dir():
        raise UserError(f"--out {path}: is a folder; give the name of a file")
    if time is not None and path.suffix.lower() in FILMS:
        raise UserError(f"--time {time}: of a picture; give --out a name that ends in {', '.join(PICTURES)}")


def write_episode(
    episode: Episode,
    path: Path,
    config: FilmConfig,
    time: int | None = None,
    watch: Callable[[Iterable[Frame], int], Iterable[Frame]] = lambda frames, _: frames,
) -> None:
    """Draws an episode, as the ending of a file's name says.

    Args:
        episode: what to draw.
        path: of the file; its folder is made if it is missing.
        config: how it looks.
        time: the moment of which a picture is drawn, from 0; by default the last one.
        watch: passes the frames of a film on, and is told how many come.

    Raises:
        UserError: no such file or moment, it cannot be written, or ffmpeg fails.
    """
    check_name(path, time)
    if time is not None and not 0 <= time <= episode.steps:
        which = f"episode {episode.number} of seed {episode.seed}"
        raise UserError(f"--time {time}: {which} has moments 0 to {episode.steps}")
    with disk_errors(path):
        path.parent.mkdir(parents=True, exist_ok=True)
    picture, kind = Picture(episode, config.size), path.suffix.lower()

    def write(temporary: Path) -> None:
        if kind in PICTURES:
            _write_picture(picture, episode.steps if time is None else time, kind, temporary)
            return
        moments = moments_of(episode.steps, config)
        frames = watch(_frames(picture, moments), len(moments))
        if kind == ".mp4":
            write_mp4(temporary, frames, picture.size, config.fps)
        else:
            few = _frames(picture, np.linspace(0, episode.steps, SAMPLES))
            write_gif(temporary, frames, few, picture.size, config.fps)

    write_whole(path, write)


def moments_of(steps: int, config: FilmConfig) -> Float[np.ndarray, " frames"]:
    """When in an episode each frame is; the last moment stays for a while."""
    moving = np.arange(steps * config.fps) * config.speed / config.fps
    return np.append(moving[moving < steps], np.full(max(1, round(HOLD * config.fps)), float(steps)))


def _write_picture(picture: Picture, moment: int, kind: str, path: Path) -> None:
    figure = picture.show(moment)
    # Equal pictures are equal bytes.
    metadata = {"Date": None, "Creator": None} if kind == ".svg" else {"Software": None}
    with matplotlib.rc_context({**STYLE, "svg.hashsalt": "skillcrew"}):
        figure.savefig(path, format=kind.removeprefix("."), dpi=figure.dpi, metadata=metadata)


def _frames(picture: Picture, moments: np.ndarray) -> Iterator[Frame]:
    last, frame = np.nan, np.zeros((0, 0, 3), np.uint8)
    for moment in moments:
        if moment != last:
            last, frame = moment, picture.frame(moment)
        yield frame
