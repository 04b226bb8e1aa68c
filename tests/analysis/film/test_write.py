"""Films and pictures as files."""

import subprocess
from pathlib import Path

import numpy as np
import pytest
from imageio_ffmpeg import get_ffmpeg_exe
from matplotlib.image import imread

import skillcrew as sc
from analysis.film import filmed
from skillcrew.analysis.film.picture import Picture
from skillcrew.analysis.film.write import FilmConfig, check_name, moments_of, write_episode

SMALL = FilmConfig(size=320, fps=4, speed=2)


def test_frames_go_through_the_episode_and_stay_at_its_end():
    moments = moments_of(6, SMALL)
    np.testing.assert_allclose(moments, [*np.arange(0, 6, 0.5), *[6] * 6])
    assert moments_of(3, FilmConfig(fps=1, speed=100)).tolist() == [0, 3, 3]


def decoded(path, picture):
    """All frames of a film, and what ffmpeg says of it."""
    words = [get_ffmpeg_exe(), "-i", str(path), "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    done = subprocess.run(words, capture_output=True, check=True)
    frames = np.frombuffer(done.stdout, np.uint8).reshape(-1, *picture.frame(0).shape)
    return frames, done.stderr.decode()


def test_an_mp4_shows_the_episode(tmp_path):
    path, told = tmp_path / "new" / "team.MP4", []

    def watch(frames, total):
        told.append(total)
        return frames

    write_episode(filmed.failed(), path, SMALL, watch=watch)
    picture = Picture(filmed.failed(), SMALL.size)
    frames, said = decoded(path, picture)
    assert "h264" in said and "yuv420p" in said and " 4 fps" in said
    assert [len(frames)] == told == [18]
    for index, moment in ((0, 0), (5, 2.5), (-1, 6)):
        assert np.abs(frames[index].astype(float) - picture.frame(moment)).mean() < 4, moment
    assert [one.name for one in path.parent.iterdir()] == ["team.MP4"]


def test_a_gif_shows_the_episode_for_ever(tmp_path):
    path = tmp_path / "team.gif"
    write_episode(filmed.failed(), path, SMALL)
    picture = Picture(filmed.failed(), SMALL.size)
    frames, said = decoded(path, picture)
    assert len(frames) == 18 and " 4 fps" in said and b"NETSCAPE2.0\x03\x01\x00\x00" in path.read_bytes()
    for index, moment in ((0, 0), (5, 2.5), (-1, 6)):
        assert np.abs(frames[index].astype(float) - picture.frame(moment)).mean() < 2, moment


def test_pictures_of_one_moment(tmp_path):
    for kind in ("png", "svg"):
        for name in ("one", "other"):
            write_episode(filmed.failed(), tmp_path / f"{name}.{kind}", SMALL, time=2)
        assert (tmp_path / f"one.{kind}").read_bytes() == (tmp_path / f"other.{kind}").read_bytes()
    shown = imread(tmp_path / "one.png")[..., :3]
    picture = Picture(filmed.failed(), SMALL.size)
    np.testing.assert_allclose(shown, picture.frame(2) / 255, atol=0.02)
    write_episode(filmed.failed(), tmp_path / "one.png", SMALL)
    np.testing.assert_allclose(imread(tmp_path / "one.png")[..., :3], picture.frame(6) / 255, atol=0.02)
    text = (tmp_path / "one.svg").read_text()
    assert text.startswith("<?xml") and "<img" not in text and "<script" not in text


@pytest.mark.parametrize("time", [-1, 7])
def test_a_moment_outside_of_the_episode(time, tmp_path):
    with pytest.raises(sc.UserError, match=f"--time {time}: episode .* of seed 11 has moments 0 to 6"):
        write_episode(filmed.failed(), tmp_path / "a.png", SMALL, time=time)
    assert not list(tmp_path.iterdir())


def test_a_place_that_cannot_be_written():
    with pytest.raises(sc.UserError, match=r"^/dev/null/a\.png: cannot be written"):
        write_episode(filmed.failed(), Path("/dev/null/a.png"), SMALL)


@pytest.mark.parametrize("ending", ["gif", "mp4"])
def test_ffmpeg_that_fails_is_one_line_and_leaves_the_old_file(ending, tmp_path, monkeypatch):
    path, program = tmp_path / f"a.{ending}", tmp_path / "ffmpeg"
    path.write_text("old")
    program.write_text("#!/bin/sh\necho Banner >&2\necho 'Unknown encoder' >&2\nexit 3\n")
    monkeypatch.setenv("IMAGEIO_FFMPEG_EXE", str(program))
    with pytest.raises(sc.UserError, match=r"^ffmpeg cannot be started: .*; install imageio-ffmpeg again"):
        write_episode(filmed.failed(), path, SMALL)
    program.chmod(0o755)
    with pytest.raises(sc.UserError, match=r"^ffmpeg makes no film: Unknown encoder; IMAGEIO_FFMPEG_EXE"):
        write_episode(filmed.failed(), path, SMALL)
    assert path.read_text() == "old" and sorted(tmp_path.iterdir()) == [path, program]


def test_names_and_sizes_that_cannot_be(tmp_path):
    with pytest.raises(sc.UserError, match=r"ends in \.gif, \.mp4, \.png, \.svg$"):
        check_name(tmp_path / "team.avi", None)
    with pytest.raises(sc.UserError, match="is a folder"):
        (tmp_path / "a.mp4").mkdir()
        check_name(tmp_path / "a.mp4", None)
    with pytest.raises(sc.UserError, match="--time 3: of a picture"):
        check_name(tmp_path / "b.gif", 3)
    for wrong in ({"size": 10}, {"fps": 0}, {"speed": 1000}):
        ((name, value),) = wrong.items()
        with pytest.raises(sc.UserError, match=f"^{name} = {value}: give a number from"):
            FilmConfig(**wrong)
