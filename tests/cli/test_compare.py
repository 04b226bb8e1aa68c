"""`skillcrew compare` from its words to its results; a stub stands for the training of each run."""

import csv
import importlib.util
from pathlib import Path

import pytest
import yaml

import skillcrew as sc
from cli import stub_training
from skillcrew.analysis import comparison_report
from skillcrew.cli import compare, side_by_side
from skillcrew.cli.main import run_command
from skillcrew.experiment.comparison import ComparisonFolder
from skillcrew.experiment.config import RunConfig

SEEDS = (6, 1)
USUAL = ("--seeds", "6,1", "--steps", "8000", "--environment.n-agents", "3", "--out", "here", "--jobs", "2")
LENIENT = """
algorithm:
  name: ccea
  population: 24
  coevolution:
    teams: 4
"""


@pytest.fixture(autouse=True)
def folder_with_a_configuration(monkeypatch, tmp_path):
    monkeypatch.setattr("skillcrew.analysis.comparison.RESAMPLES", 40)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "options").mkdir()
    (tmp_path / "options" / "lenient.yaml").write_text(LENIENT)


@pytest.fixture
def trains(monkeypatch, tmp_path_factory):
    """What the stub was asked to do, in order."""
    env = sc.make("rover-t2-c2", n_agents=3)
    runs = compare._runs(["ea", "madys-plus", "options/lenient.yaml"], env, RunConfig(SEEDS, 8000))
    return stub_training.install(
        monkeypatch,
        tmp_path_factory.mktemp("stub"),
        runs,
        lambda index: ({6: 0.9 - index / 10, 1: 1.0}, {6: 20 - index, 1: index}),
    )


@pytest.fixture
def panels(monkeypatch):
    """What is drawn, of which the pictures are spared."""
    caught = []
    draw = comparison_report.panels_of_curves
    monkeypatch.setattr(
        comparison_report, "panels_of_curves", lambda *given: caught.append(given) or draw(*given)
    )

    def touch(figure, stem):
        path = stem.with_name(f"{stem.name}.png")
        path.touch()
        return [path]

    monkeypatch.setattr(comparison_report, "save", touch)
    return caught


def call(*words):
    """The exit code of a command line; tyro leaves through `SystemExit`."""
    try:
        return run_command(["compare", *map(str, words)])
    except SystemExit as end:
        return end.code or 0


METHODS = "ea, madys-plus,options/lenient.yaml"


def test_trains_all_methods_and_ends_in_one_figure_and_one_table(trains, panels, tmp_path, capsys):
    assert call(METHODS, "rover-t2-c2", *USUAL) == 0
    written = [Path(line) for line in capsys.readouterr().out.splitlines()]
    assert all(path.exists() for path in written)
    assert written[:3] == [
        Path("here/figures/rover-t2-c2.png"),
        Path("here/table.md"),
        Path("here/table.csv"),
    ]
    assert sorted(trains()) == [f"train rover-t2-c2-{name}" for name in ("ea", "lenient", "madys-plus")]
    with Path("here/table.csv").open(newline="") as file:
        rows = [(row["method"], int(row["seed"]), float(row["success"])) for row in csv.DictReader(file)]
    assert rows == [
        (label, seed, wins / 20)
        for index, label in enumerate(("EA", "MADyS+", "lenient"))
        for seed, wins in ((6, 20 - index), (1, index))
    ]
    assert "better than EA" in Path("here/table.md").read_text()
    ((drawn, title),) = panels
    assert title == "rover-t2-c2: mean of 2 seeds, 95 % intervals"
    assert [curve.label for curve in drawn["rover-t2-c2"]] == ["EA", "MADyS+", "lenient"]
    assert "compares EA, MADyS+, lenient on rover-t2-c2" in Path("here/README.txt").read_text()


def test_options_reach_every_run(trains, panels, tmp_path):
    assert call(METHODS, "rover-t2-c2", *USUAL) == 0
    configs = {
        path.stem.removeprefix("rover-t2-c2-"): yaml.safe_load(path.read_text())
        for path in Path("here/configurations").iterdir()
    }
    assert set(configs) == {"ea", "madys-plus", "lenient"}
    for config in configs.values():
        assert config["environment"]["n_agents"] == 3
        assert config["run"]["seeds"] == [6, 1] and config["run"]["steps"] == 8000
    lenient, plain = configs["lenient"]["algorithm"], configs["ea"]["algorithm"]
    assert (lenient["name"], lenient["population"], lenient["coevolution"]["teams"]) == ("ccea", 24, 4)
    assert lenient["episodes"] == plain["episodes"], "what the file does not give has its default"


def test_the_same_command_goes_on_and_another_is_refused(trains, panels, tmp_path, capsys):
    assert call(METHODS, "rover-t2-c2", *USUAL) == 0
    begun = trains()
    assert call(METHODS, "rover-t2-c2", *USUAL) == 0
    assert trains() == begun, "nothing was left to train"
    capsys.readouterr()
    assert call(METHODS, "rover-t2-c2", *USUAL, "--steps", "9000") == 2
    assert "run.steps is 8000 there and 9000 is asked for" in capsys.readouterr().err


def test_every_run_has_the_trackers_and_may_be_given_others_later(trains, panels, tmp_path):
    assert call(METHODS, "rover-t2-c2", *USUAL, "--trackers", "tensorboard") == 0
    configs = [yaml.safe_load(path.read_text()) for path in Path("here/configurations").iterdir()]
    assert [config["run"]["trackers"] for config in configs] == 3 * [["tensorboard"]]
    assert call(METHODS, "rover-t2-c2", *USUAL) == 0, "they change nothing that is compared"
    env = sc.make("rover-t2-c2", n_agents=3)
    (run, _) = compare._runs(["ea", "mfl"], env, RunConfig(SEEDS, 8000, trackers=("tensorboard",)))
    job = side_by_side._job(run, ComparisonFolder("here"), trust=False)
    assert job.words == ("resume", "here/runs/rover-t2-c2/ea", "--trackers", "tensorboard")


def test_a_tracker_that_cannot_be_used_is_told_before_anything_is_made(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    assert call("ea,ccea", "rover-t2-c2", *USUAL, "--trackers", "wandb") == 2
    assert "trackers: wandb is not installed" in capsys.readouterr().err
    assert not Path("here").exists()


def test_the_folder_is_named_after_the_environment(trains, panels, tmp_path):
    words = [word for word in USUAL if word not in ("--out", "here")]
    assert call(METHODS, "rover-t2-c2", *words) == 0
    assert Path("runs/compare-rover-t2-c2/table.md").is_file()


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ([], ["METHODS is missing", "usage: skillcrew compare METHODS ENVIRONMENT"]),
        (["madys,ea"], ["ENVIRONMENT is missing"]),
        (["madys", "rover-t2-c1"], ["METHODS = madys", "two or more", "such as madys,ea"]),
        (["madys,,ea", "rover-t2-c1"], ["METHODS = madys,,ea", "two or more"]),
        (["madys,maydsplus", "rover-t2-c1"], ["unknown algorithm 'maydsplus'", "madys-plus"]),
        (["ea,ea", "rover-t2-c1"], ["ea is given twice"]),
        (["ea,mfl", "rover-t4-c1"], ["unknown environment 'rover-t4-c1'"]),
        (["ea,none.yaml", "rover-t2-c1"], ["none.yaml", "cannot be read"]),
        (["ea,options/empty.yaml", "rover-t2-c1"], ["options/empty.yaml", "section algorithm"]),
        (["ea,options/wrong.yaml", "rover-t2-c1"], ["options/wrong.yaml: algorithm", "'popluation'"]),
        (["mfl,options/ea.yaml", "rover-t2-c1"], ["options/ea.yaml", "like the algorithm ea", "rename"]),
        (
            ["ea,options/lenient.yaml", "rover-t2-c1"],
            ["options/lenient.yaml: algorithm", "coevolution.teams = 4", "1 agent(s)"],
        ),
        (["ea,mfl", "rover-t2-c1", "--jobs", "0"], ["--jobs 0", "at least 1"]),
        (["ea,mfl", "rover-t2-c1", "--budget", "0.5"], ["unknown option --budget"]),
        (["ea,mfl", "rover-t2-c1", "--environment.n-agents", "0"], ["n_agents = 0"]),
    ],
)
def test_a_mistake_is_one_line_and_exit_code_2(words, expected, capsys, tmp_path, monkeypatch):
    monkeypatch.setattr(side_by_side, "run_jobs", lambda *_: pytest.fail("it began to train"))
    (tmp_path / "options" / "empty.yaml").write_text("run: {}\n")
    (tmp_path / "options" / "wrong.yaml").write_text("algorithm: {name: ea, popluation: 3}\n")
    (tmp_path / "options" / "ea.yaml").write_text("algorithm: {name: ea}\n")
    assert call(*words) == 2
    captured = capsys.readouterr()
    assert captured.out == "" and captured.err.count("\n") == 1
    for part in expected:
        assert part in captured.err


def test_help_names_the_methods(capsys):
    assert call("--help") == 0
    out = capsys.readouterr().out
    for part in ("METHODS", "madys", "ccea", "lenient.yaml", "rover-t3-c3"):
        assert part in out
    assert call("madys,ea", "rover-t2-c1", "--help") == 0
    out = capsys.readouterr().out
    for part in ("--seeds", "--steps", "--out", "--jobs", "--environment.n-agents"):
        assert part in out
