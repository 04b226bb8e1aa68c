"""Frames to a film, by the ffmpeg that imageio-ffmpeg brings along."""

import contextlib
import subprocess
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import IO, cast

import imageio_ffmpeg
import numpy as np
from jaxtyping import UInt8

from skillcrew.errors import UserError

Frame = UInt8[np.ndarray, "height width 3"]

MP4 = (
    "-c:v",
    "libx264",
    "-preset",
    "veryfast",
    "-crf",
    "20",
    "-pix_fmt",
    "yuv420p",
    "-movflags",
    "+faststart",
    "-f",
    "mp4",
)
"""What every browser and player shows."""

PALETTE = ("-vf", "palettegen", "-f", "apng")

GIF = ("-lavfi", "paletteuse=dither=none:diff_mode=rectangle", "-loop", "0", "-f", "gif")
"""For ever; what has not changed since the last frame is left out."""


def write_mp4(path: Path, frames: Iterable[Frame], size: tuple[int, int], fps: int) -> None:
    """Makes a film of frames as they come.

    Args:
        path: of the file.
        frames: all of one size.
        size: width and height, both even.
        fps: frames per second.

    Raises:
        UserError: ffmpeg is not there, or fails.
    """
    _encode(frames, size, fps, MP4, path)


def write_gif(
    path: Path, frames: Iterable[Frame], few: Iterable[Frame], size: tuple[int, int], fps: int
) -> None:
    """As `write_mp4`, in no more colours than 256.

    Args:
        path: as there.
        frames: as there.
        few: of the frames, from which the colours are chosen.
        size: width and height.
        fps: frames per second.
    """
    with tempfile.TemporaryDirectory() as folder:
        palette = Path(folder) / "palette.png"
        _encode(few, size, fps, PALETTE, palette)
        _encode(frames, size, fps, ("-i", f"file:{palette}", *GIF), path)


def _encode(
    frames: Iterable[Frame], size: tuple[int, int], fps: int, coding: tuple[str, ...], path: Path
) -> None:
    raw = ("-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{size[0]}x{size[1]}", "-r", str(fps), "-i", "-")
    words = ("-loglevel", "error", "-y", *raw, *coding, f"file:{path.absolute()}")
    with tempfile.TemporaryFile() as said:
        process = _start(words, said)
        try:
            # It may end before it has read all.
            with contextlib.suppress(BrokenPipeError), cast(IO[bytes], process.stdin) as pipe:
                for frame in frames:
                    pipe.write(np.ascontiguousarray(frame).data)
            code = process.wait()
        finally:
            process.kill()
            process.wait()
        said.seek(0)
        lines = said.read().decode(errors="replace").strip().splitlines()
    if code:
        why = lines[-1] if lines else f"it ends with exit code {code}"
        raise UserError(f"ffmpeg makes no film: {why}; IMAGEIO_FFMPEG_EXE can name another one")


def _start(words: tuple[str, ...], said: IO[bytes]) -> subprocess.Popen[bytes]:
    try:
        program = imageio_ffmpeg.get_ffmpeg_exe()
        return subprocess.Popen((program, *words), stdin=subprocess.PIPE, stdout=said, stderr=said)
    except (RuntimeError, OSError) as error:
        raise UserError(
            f"ffmpeg cannot be started: {error}; install imageio-ffmpeg again, or name one by "
            "IMAGEIO_FFMPEG_EXE"
        ) from None
