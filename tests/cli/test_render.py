"""`skillcrew render` as a user meets it."""

import json
import shutil

import pytest

from cli.test_commands import call
from experiment import tiny


@pytest.fixture(autouse=True)
def here(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)


def test_help_teaches_its_options(capsys):
    assert call(["render", "--help"]) == 0
    shown = capsys.readouterr().out
    for part in ("RUN", "--out", "--episode", "--time", "--fps", "--size", "--quiet", "--trust", "fastest"):
        assert part in shown


def test_a_picture_of_the_seed_that_is_asked_for(finished, tmp_path, capsys):
    words = ["render", str(finished), "--seed", "11", "--episode", "5", "--size", "320", "--json"]
    assert call([*words, "--out", "deep/team.png", "--time", "1"]) == 0
    captured = capsys.readouterr()
    printed = json.loads(captured.out)
    assert captured.err == "" and printed["written"] == "deep/team.png"
    assert (printed["seed"], printed["episode"]) == (11, 5) and 1 <= printed["steps"] <= 6
    assert (tmp_path / "deep" / "team.png").read_bytes().startswith(b"\x89PNG")


def test_by_default_a_film_in_the_runs_report(copied, capsys):
    before = {path for path in copied.rglob("*")}
    assert call(["render", str(copied), "--size", "320", "--fps", "2"]) == 0
    captured = capsys.readouterr()
    (film,) = {path for path in copied.rglob("*") if path.is_file()} - before
    assert captured.out == f"{film}\n" and captured.err == "" and film.suffix == ".mp4"
    assert film.parent == copied / "report" and film.name.startswith("seed_3_episode_")


MISTAKES = [
    (["render"], ["RUN is missing"]),
    (["render", "nowhere"], ["nowhere: no such run folder"]),
    (["render", "RUN", "--out", "team.avi"], ["--out team.avi", ".gif, .mp4, .png, .svg"]),
    (["render", "RUN", "--out", "team"], ["--out team: give a name that ends in"]),
    (["render", "RUN", "--out", "a.gif", "--time", "2"], ["--time 2: of a picture"]),
    (["render", "RUN", "--out", "a.png", "--time", "70"], ["--time 70", "moments 0 to"]),
    (["render", "RUN", "--out", "a.png", "--episode", "100"], ["--episode 100", "0 to 99"]),
    (["render", "RUN", "--out", "a.png", "--seed", "12"], ["seed 12: not of this run, which has 3, 11"]),
    (["render", "RUN", "--out", "a.png", "--checkpoint", "999"], ["no checkpoint 999"]),
    (["render", "RUN", "--out", "a.png", "--size", "9"], ["size = 9: give a number from 320 to 4096"]),
    (["render", "RUN", "--epsiode", "3"], ["unknown option --epsiode", "--episode"]),
]


@pytest.mark.parametrize(("words", "expected"), MISTAKES, ids=lambda value: " ".join(value))
def test_a_mistake_is_one_line_and_exit_code_2(words, expected, finished, tmp_path, capsys):
    before = tiny.contents(finished)
    assert call([str(finished) if word == "RUN" else word for word in words]) == 2
    captured = capsys.readouterr()
    assert captured.out == "" and captured.err.count("\n") == 1 and captured.err.startswith("skillcrew: ")
    for part in expected:
        assert part in captured.err
    assert not list(tmp_path.iterdir()) and tiny.contents(finished) == before


def test_a_run_without_a_champion(copied, capsys):
    shutil.rmtree(copied / "checkpoints")
    assert call(["render", str(copied), "--out", "a.png"]) == 2
    captured = capsys.readouterr()
    assert captured.err.count("\n") == 1 and "checkpoint" in captured.err
