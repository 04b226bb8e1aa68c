"""Every command on a world that skillcrew does not ship, as its author meets it."""

import json
import sys

import pytest
import yaml

from cli.test_commands import call
from envs.stranger import write_package

WORLD = "line_lab.worlds:LineWorld"
SMALL = (
    *("--algorithm.population", "6", "--algorithm.episodes", "2", "--algorithm.evolution.elites", "2"),
    *("--score-episodes", "3", "--report-episodes", "5", "--generations-per-report", "2"),
)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(write_package(tmp_path))
    monkeypatch.setattr(sys, "path", list(sys.path))
    yield tmp_path
    for name in [name for name in sys.modules if name.partition(".")[0] == "line_lab"]:
        del sys.modules[name]


def test_trained_resumed_evaluated_and_reported_by_commands_alone(folder, capsys):
    words = ["train", "ea", f"{WORLD}/narrow", "--environment.probes", "3", "--steps", "300", *SMALL]
    assert call(words) == 0
    run = folder / "runs" / "ea-line-world-narrow"
    section = yaml.safe_load((run / "config.yaml").read_text())["environment"]
    assert section == {"name": "line-world-narrow", "class": WORLD, "probes": 3, "reach": 0.1}
    capsys.readouterr()
    for command in (["evaluate", str(run)], ["report", str(run)], ["resume", str(run)]):
        assert call(command) == 2
        line = capsys.readouterr().err
        assert line.count("\n") == 1 and f"class = {WORLD}" in line and "give --trust" in line
    assert call(["resume", str(run), "--trust", "--steps", "600", "--report-episodes", "5"]) == 0
    capsys.readouterr()
    assert call(["evaluate", str(run), "--trust", "--episodes", "7", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["episodes"] == 7
    assert call(["report", str(run), "--trust", "--episodes", "5"]) == 0
    again = ["train", "--config", str(run / "config.yaml"), "--out", "again", "--steps", "300"]
    assert call(again) == 2
    assert call([*again, "--trust", "--report-episodes", "5"]) == 0


def test_where_its_code_is_not_there_one_line_says_what_to_install(folder, capsys, monkeypatch, tmp_path):
    assert call(["train", "ea", WORLD, "--steps", "300", *SMALL]) == 0
    for name in [name for name in sys.modules if name.partition(".")[0] == "line_lab"]:
        del sys.modules[name]
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    monkeypatch.setattr(sys, "path", [entry for entry in sys.path if entry != str(folder)])
    capsys.readouterr()
    assert call(["evaluate", str(folder / "runs" / "ea-line-world"), "--trust"]) == 2
    line = capsys.readouterr().err
    assert line.count("\n") == 1 and "no module line_lab here" in line and "install the package" in line


def test_its_options_are_the_command_lines(folder, capsys):
    assert call(["train", "madys", WORLD, "--help"]) == 0
    assert "How close is there, in metres" in capsys.readouterr().out
    assert call(["train", "madys", WORLD, "--environment.probes", "0"]) == 2
    assert "probes = 0: give at least 1" in capsys.readouterr().err
    assert call(["train", "madys", WORLD, "--environment.prbes", "2"]) == 2
    assert "nearest: --environment.probes" in capsys.readouterr().err


def test_methods_are_compared_on_it(folder, capsys):
    algorithm = {"name": "ea", "population": 6, "episodes": 2, "evolution": {"elites": 2}}
    for name in ("few", "more"):
        (folder / f"{name}.yaml").write_text(yaml.safe_dump({"algorithm": algorithm}))
        algorithm = {**algorithm, "population": 8}
    words = ["compare", "few.yaml,more.yaml", WORLD, "--steps", "200", "--seeds", "1", "--jobs", "2"]
    assert call(words) == 0, capsys.readouterr().err
    results = folder / "runs" / "compare-line-world"
    assert "line-world" in (results / "table.md").read_text()


def test_list_shows_what_packages_offer_and_what_does_not_load(folder, capsys, monkeypatch):
    places = {"line": WORLD, "licensed": "line_lab.broken:World"}
    monkeypatch.syspath_prepend(str(write_package(folder / "site", places)))
    assert call(["list"]) == 0
    shown = capsys.readouterr().out
    assert f"({WORLD})" in shown and "narrow" in shown
    assert "licensed" in shown and "fails to load" in shown and "no licence" in shown
    assert call(["list", "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["environments"]["narrow"]["reach"] == 0.1 and "licensed" in printed["broken"]
    # An entry point is trusted: somebody installed it.
    small = ("--algorithm.population", "6", "--algorithm.episodes", "2", "--algorithm.evolution.elites", "2")
    assert call(["train", "ea", "narrow", "--steps", "300", *small, "--report-episodes", "3"]) == 0
    assert call(["evaluate", str(folder / "runs" / "ea-narrow"), "--episodes", "3"]) == 0
