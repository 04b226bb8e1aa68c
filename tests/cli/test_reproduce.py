"""`skillcrew reproduce` from its words to its results; a stub stands for the training of each run."""

import csv
import os
import shlex
import shutil

import pytest

from cli import stub_training
from experiment import made_up
from experiment.tiny import contents
from skillcrew.analysis import comparison_report
from skillcrew.cli import jobs, side_by_side
from skillcrew.cli.main import run_command
from skillcrew.experiment.comparison import ComparisonFolder
from skillcrew.experiment.device_memory import in_gib
from skillcrew.experiment.folder import RunFolder
from skillcrew.experiment.reproduction import plan

SEEDS = (6, 1)


@pytest.fixture(autouse=True)
def small(monkeypatch, tmp_path):
    """A small reproduction in a folder of its own."""
    made_up.shrink(monkeypatch)
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def trains(monkeypatch, tmp_path_factory):
    """Puts the stub in the place of training; returns what it was asked to do, in order."""
    runs = plan(["fig-4.2"], SEEDS)
    return stub_training.install(monkeypatch, tmp_path_factory.mktemp("stub"), runs, made_up_results)


def made_up_results(index):
    """How high the two seeds climb in one of the runs, and how many of their episodes they solve."""
    return {6: 0.9 - index / 10, 1: 1.0}, {6: 20 - index, 1: index}


@pytest.fixture
def never_trains_more(monkeypatch):
    """From when it is called on."""

    def refuse(*_, **__):
        raise AssertionError("it began to train")

    return lambda: monkeypatch.setattr(side_by_side, "run_jobs", refuse)


@pytest.fixture
def never_trains(never_trains_more):
    never_trains_more()


@pytest.fixture
def not_drawn(monkeypatch):
    """Spares what takes longest: figures are files without a picture."""

    def touch(figure, stem):
        path = stem.with_name(f"{stem.name}.png")
        path.touch()
        return [path]

    monkeypatch.setattr(comparison_report, "save", touch)


def call(*words):
    """The exit code of a command line; tyro leaves through `SystemExit`."""
    try:
        return run_command(["reproduce", *map(str, words)])
    except SystemExit as end:
        return end.code or 0


def one_line(capsys):
    """The only line that was said."""
    captured = capsys.readouterr()
    assert captured.out == "" and captured.err.count("\n") == 1, captured
    return captured.err


USUAL = ("--seeds", "6,1", "--out", "here", "--jobs", "2")


# From the beginning to the end


def test_trains_all_and_ends_in_the_results(trains, tmp_path, capsys):
    assert call("fig-4.2", *USUAL) == 0
    captured = capsys.readouterr()
    paths = [tmp_path / line for line in captured.out.splitlines()]
    assert all(path.exists() for path in paths)
    names = [str(path.relative_to(tmp_path / "here")) for path in paths]
    assert names[:4] == ["figures/fig-4.2.png", "figures/fig-4.2.pdf", "table.md", "table.csv"]
    assert {"figures/skills-rover-t2-c2-mfl.pdf", "configurations", "environment.txt"} < set(names)
    with (tmp_path / "here" / "table.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    expected = [
        (environment, method, seed, wins / 20)
        for index, (environment, method) in enumerate(
            (environment, method)
            for environment in ("rover-t2-c1", "rover-t2-c2")
            for method in ("MADyS", "MFL", "EA")
        )
        for seed, wins in ((6, 20 - index), (1, index))
    ]
    assert [(r["environment"], r["method"], int(r["seed"]), float(r["success"])) for r in rows] == expected
    for one in plan(["fig-4.2"], SEEDS):
        assert f"] {one.name} ended after 0:0" in captured.err
        assert ComparisonFolder("here").log(one).read_text() == f"working on {one.name}\n"
        assert ComparisonFolder("here").run(one).config.read_text() == one.to_yaml()
    lines = captured.err.splitlines()
    assert lines[0] == "6 runs: 0 done, 6 to train, 2 at a time."
    assert lines[-1].startswith("[6/6] ") and lines[-1].endswith(lines[-1].split()[1])


def test_the_longest_runs_come_first(trains, not_drawn):
    assert call("fig-4.2", "--seeds", "6,1", "--out", "here", "--jobs", "1") == 0
    # Fewer steps, but of two rovers and not of one.
    assert [words.split()[1] for words in trains()] == [
        f"{environment}-{method}"
        for environment in ("rover-t2-c2", "rover-t2-c1")
        for method in ("madys", "mfl", "ea")
    ]


def test_what_is_done_is_not_trained_again(trains, not_drawn, monkeypatch, capsys):
    assert call("fig-4.2", *USUAL) == 0
    first = capsys.readouterr()
    assert len(trains()) == 6
    before = {name: data for name, data in contents(RunFolder("here").path).items() if "/" in name}
    # Nothing is to be trained, however little memory is free.
    monkeypatch.setattr(side_by_side, "available", lambda: 0)
    monkeypatch.setattr(jobs, "START", "import sys; sys.exit(1)")
    assert call("fig-4.2", "--seeds", "6,1", "--out", "here") == 0
    again = capsys.readouterr()
    assert (again.out, again.err) == (first.out, "")
    assert {name: data for name, data in contents(RunFolder("here").path).items() if "/" in name} == before


def test_only_what_is_missing_is_trained(trains, not_drawn, capsys):
    assert call("fig-4.2", *USUAL) == 0
    one = plan(["fig-4.2"], SEEDS)[3]
    place = ComparisonFolder("here").run(one)
    shutil.rmtree(place.path)
    assert call("fig-4.2", *USUAL) == 0
    assert trains()[6:] == [f"train {one.name}"]
    # Trained, but not scored: the run's own `resume` does that.
    shutil.rmtree(place.report)
    assert call("fig-4.2", *USUAL) == 0
    assert trains()[7:] == [f"resume {one.name}"]
    assert "6 runs: 5 done, 1 to train" in capsys.readouterr().err


def test_so_far_nothing_is_trained_and_what_is_done_is_shown(trains, not_drawn, never_trains_more, capsys):
    assert call("fig-4.2", *USUAL) == 0
    runs = plan(["fig-4.2"], SEEDS)
    for one in runs[1:]:
        shutil.rmtree(ComparisonFolder("here").run(one).path)
    never_trains_more()
    capsys.readouterr()
    assert call("fig-4.2", *USUAL, "--so-far") == 0
    captured = capsys.readouterr()
    assert captured.err == "1 of 6 runs are finished.\n"
    with open("here/table.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert {(row["environment"], row["method"]) for row in rows} == {("rover-t2-c1", "MADyS")}
    shutil.rmtree(ComparisonFolder("here").run(runs[0]).path)
    assert call("fig-4.2", *USUAL, "--so-far") == 2
    assert one_line(capsys) == (
        "skillcrew: --so-far: none of 6 runs is finished in here; train them without it\n"
    )
    assert call("fig-4.2", "--out", "nowhere", "--so-far") == 2
    assert "finished in nowhere" in one_line(capsys) and not os.path.exists("nowhere")


# What goes wrong


def test_a_failed_run_is_named_with_its_last_line_and_log(trains, not_drawn, monkeypatch, capsys):
    monkeypatch.setenv("FAIL", "rover-t2-c1-mfl")
    assert call("fig-4.2", *USUAL) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    line = captured.err.splitlines()[-1]
    assert line.startswith("skillcrew: rover-t2-c1-mfl failed: RuntimeError: out of luck ")
    assert "here/logs/rover-t2-c1-mfl.log" in line
    assert f"`skillcrew reproduce fig-4.2 {' '.join(USUAL)}` goes on" in line
    assert not (RunFolder("here").path / "table.md").exists()
    assert len(trains()) == 6, "others did not run"
    monkeypatch.delenv("FAIL")
    assert call("fig-4.2", *USUAL) == 0
    assert trains()[6:] == ["train rover-t2-c1-mfl"]


def test_interrupted_says_the_command_that_goes_on(trains, not_drawn, monkeypatch, capsys):
    monkeypatch.setenv("INTERRUPT", "rover-t2-c2-mfl")
    words = ("fig-4.2", "--seeds", "6,1", "--out", "my folder", "--jobs", "1")
    assert call(*words) == 130
    captured = capsys.readouterr()
    assert captured.out == ""
    line = captured.err.splitlines()[-1]
    assert line.startswith("Interrupted and saved. `") and line.endswith("` goes on.")
    said = shlex.split(line.split("`")[1])
    assert said == ["skillcrew", "reproduce", *words]
    assert trains() == ["train rover-t2-c2-madys", "train rover-t2-c2-mfl"]
    monkeypatch.delenv("INTERRUPT")
    assert call(*said[2:]) == 0
    assert trains()[2:] == [
        "resume rover-t2-c2-mfl",
        "train rover-t2-c2-ea",
        *[f"train rover-t2-c1-{method}" for method in ("madys", "mfl", "ea")],
    ]
    assert "my folder/table.md" in capsys.readouterr().out.splitlines()


@pytest.mark.usefixtures("never_trains")
def test_another_configuration_is_refused_and_nothing_changed(tmp_path, capsys):
    one = plan(["fig-4.2"], SEEDS)[0]
    folder = ComparisonFolder("here")
    folder.open("This folder is for a test.")
    made_up.write_run(folder.run(one), one, {6: 0.5, 1: 0.5})
    before = contents(tmp_path)
    for words, said in (
        (("--budget", "0.5", "--seeds", "6,1"), "algorithm.plateau.latest is None there and 21 is asked for"),
        (("--seeds", "3"), "run.seeds is [6, 1] there and [0, 1, 2] is asked for"),
        ((), "run.seeds is [6, 1] there and [2000, 2001, 2002, 2003, 2004] is asked for"),
    ):
        assert call("fig-4.2", "--out", "here", *words) == 2
        line = one_line(capsys)
        assert f"here/runs/rover-t2-c1/madys/config.yaml: {said}" in line
        assert "--out" in line
    assert contents(tmp_path) == before


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ([], ["FIGURE is missing", "usage: skillcrew reproduce FIGURE"]),
        (["--seeds", "2"], ["FIGURE is missing"]),
        (["fig4.2"], ["unknown figure 'fig4.2'", "first: fig-4.2, fig-4.3, frontier"]),
        (["fig-4.2", "--budget", "0"], ["--budget 0.0", "share above 0 and up to 1"]),
        (["fig-4.2", "--budget", "1.5"], ["--budget 1.5", "share above 0 and up to 1"]),
        (["all", "--budget", "nan"], ["--budget nan", "share above 0 and up to 1"]),
        (["fig-4.2", "--jobs", "0"], ["--jobs 0", "at least 1"]),
        (["fig-4.2", "--jobs", "1.5"], ["'1.5'", "whole number"]),
        (["fig-4.2", "--seeds", "1,1"], ["seeds = [1, 1]", "each once"]),
        (["fig-4.2", "--sedes", "2"], ["unknown option --sedes", "--seeds", "reproduce fig-4.2 --help"]),
        (["fig-4.2", "--out", "/dev/null/x"], ["/dev/null/x", "cannot be written"]),
        (["fig-4.2", "--out", "/dev/null"], ["/dev/null", "directory"]),
    ],
    ids=lambda value: " ".join(value),
)
@pytest.mark.usefixtures("never_trains")
def test_a_mistake_is_one_line_and_exit_code_2(words, expected, capsys, tmp_path):
    assert call(*words) == 2
    line = one_line(capsys)
    assert line.startswith("skillcrew: ")
    for part in expected:
        assert part in line
    assert not list(tmp_path.iterdir()), "something was left behind"


@pytest.mark.usefixtures("never_trains")
def test_a_folder_with_something_else_is_left_alone(tmp_path, capsys):
    (tmp_path / "thesis.tex").write_text("years of work")
    assert call("fig-4.2", "--out", ".") == 2
    assert "holds something else" in one_line(capsys)
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


@pytest.mark.parametrize(
    "words", [("fig-4.2", "--budget", "much"), ("fig-4.2", "fig-4.3"), ("fig-4.2", "--out")], ids=" ".join
)
@pytest.mark.usefixtures("never_trains")
def test_what_cannot_be_parsed_is_exit_code_2(words, capsys):
    assert call(*words) == 2
    captured = capsys.readouterr()
    assert captured.out == "" and captured.err and "Traceback" not in captured.err


@pytest.mark.parametrize("words", [["--help"], ["-h"], ["fig-4.2", "--help"]], ids=" ".join)
@pytest.mark.usefixtures("never_trains")
def test_help_names_every_option(words, capsys, tmp_path):
    assert call(*words) == 0
    captured = capsys.readouterr()
    for part in ("FIGURE", "fig-4.2", "fig-4.3", "--out", "--budget", "--seeds", "--jobs", "2000"):
        assert part in captured.out
    assert captured.err == "" and not list(tmp_path.iterdir())


# How many at once


@pytest.fixture
def machine(monkeypatch):
    """Four cores, memory for three of the largest run, no GPU."""
    planned = plan(["fig-4.2", "fig-4.3"], SEEDS)
    sizes = {id(one.algorithm): 10 + index for index, one in enumerate(planned)}
    monkeypatch.setattr(side_by_side, "estimate", lambda algorithm, config: sizes[id(algorithm)])
    monkeypatch.setattr(side_by_side, "available", lambda: 3 * 18 + 1)
    monkeypatch.setattr(side_by_side, "available_cores", lambda: [0, 1, 2, 5])
    return planned


def test_as_many_at_once_as_there_are_cores_memory_and_runs_for(machine, monkeypatch):
    at_once = side_by_side._jobs_at_once
    assert at_once(None, machine) == 3
    assert at_once(None, machine[:2]) == 2
    monkeypatch.setattr(side_by_side, "available_cores", lambda: [7])
    assert at_once(None, machine) == 1
    assert at_once(5, machine) == 5, "what is asked for counts"
    monkeypatch.setattr(side_by_side, "available_cores", lambda: [0, 1])
    monkeypatch.setattr("jax.default_backend", lambda: "gpu")
    assert at_once(None, machine) == 1


def test_a_run_that_does_not_fit_is_one_line(machine, monkeypatch, capsys):
    monkeypatch.setattr(side_by_side, "estimate", lambda algorithm, config: 3 * 2**30)
    monkeypatch.setattr(side_by_side, "available", lambda: 2**30)
    monkeypatch.setattr(side_by_side, "run_jobs", lambda *_: pytest.fail("it began to train"))
    assert call("fig-4.2", "--out", "here") == 2
    line = one_line(capsys)
    assert in_gib(3 * 2**30) in line and in_gib(2**30) in line and "--seeds" in line


def test_status_is_said_now_and_then(monkeypatch, capsys, tmp_path):
    now = [100.0]
    monkeypatch.setattr("time.monotonic", lambda: now[0])
    watch = side_by_side._Watch(total=5, missing=2)
    one, two = (jobs.Job(name, (), tmp_path / name) for name in ("one", "two"))
    one.log.write_text("generation 3\n")
    watch([one, two], [])
    now[0] += 30
    watch([one, two], [])
    assert capsys.readouterr().err.splitlines() == ["one begins", "two begins"]
    now[0] += 31
    watch([one, two], [])
    assert capsys.readouterr().err.splitlines() == ["  one: generation 3", "  two: "]
    one.log.write_text("Report: [here]\n")
    now[0] += 3539
    watch([two], [one])
    lines = capsys.readouterr().err.splitlines()
    assert lines[0] == "[4/5] one ended after 1:00:00: Report: [here]"
