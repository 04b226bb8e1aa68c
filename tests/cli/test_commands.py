"""The command line as a user meets it."""

import dataclasses
import json
import re
import shutil
import subprocess
import sys

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import skillcrew as sc
from experiment import tiny
from skillcrew.cli import report as report_command
from skillcrew.cli import train as train_command
from skillcrew.cli.main import COMMANDS, run_command
from skillcrew.envs import registry
from skillcrew.envs.rover.presets import PRESETS
from skillcrew.experiment.config import RunConfig, to_yaml
from skillcrew.experiment.origin import Origin

TRAIN = ("train", "madys", "rover-t2-c1")


def call(words):
    """The exit code of a command line; tyro leaves through `SystemExit`."""
    try:
        return run_command(list(words))
    except SystemExit as end:
        return end.code or 0


@pytest.fixture(autouse=True)
def nothing_is_made_here(monkeypatch, tmp_path):
    """Default folders, if a mistake makes any, are seen and do not litter."""
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def no_training(monkeypatch):
    """Catches what would be trained."""
    caught = []
    monkeypatch.setattr(train_command, "train_and_report", lambda *given: caught.append(given) or 0)
    return caught


@pytest.fixture
def never_trains(monkeypatch):
    def refuse(*_, **__):
        raise AssertionError("it began to train")

    monkeypatch.setattr("skillcrew.experiment.runner.Runner.start", refuse)


def test_help_of_the_program_names_every_command(capsys):
    assert call(["--help"]) == 0
    shown = capsys.readouterr().out
    assert all(f"  {command}" in shown for command in COMMANDS)
    assert "skillcrew train madys" in shown
    assert call([]) == 2


@pytest.mark.parametrize(
    ("command", "taught"),
    [
        ("train", ["ALGORITHM", "ENVIRONMENT", "madys", *PRESETS, "--config", "--help"]),
        ("resume", ["RUN", "--steps", "--checkpoint", "same bits"]),
        ("evaluate", ["RUN", "--episodes", "--json", "--checkpoint"]),
        ("report", ["RUN", "--out", "--json", "--episodes"]),
        ("list", ["--json"]),
    ],
)
def test_help_of_a_command_teaches_its_options(command, taught, capsys):
    assert call([command, "--help"]) == 0
    captured = capsys.readouterr()
    for part in taught:
        assert part in captured.out
    assert captured.err == ""


def test_help_of_an_algorithm_explains_every_field(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    assert call([*TRAIN, "--help"]) == 0
    shown = re.sub(r"[│╭╮╰╯─\s]+", " ", capsys.readouterr().out)
    for part in (
        "--algorithm.population",
        "Teams (M).",
        "--algorithm.learner.discount",
        "--environment.spatial-coupling",
        "Rovers that must be within the activation distance",
        "--environment.parents",
        "--environment.simultaneous A+B,C+D|none",
        "--environment.rover-types NAME:rovers=VALUE:FIELD=VALUE,…|none",
        "--seeds",
        "2000..2004",
        "--checkpoint-seconds",
        "2000000",
    ):
        assert part in shown


MISTAKES = [
    (["trian"], ["unknown command 'trian'", "train"]),
    (["--version-of-what"], ["unknown command"]),
    (["train"], ["ALGORITHM is missing", "usage: skillcrew train"]),
    (["train", "madys"], ["ENVIRONMENT is missing"]),
    (["train", "--seeds", "3"], ["ALGORITHM is missing"]),
    (["train", "madsy", "rover-t2-c1"], ["unknown algorithm 'madsy'", "madys"]),
    (["train", "madys", "rover-t2c1"], ["unknown environment 'rover-t2c1'", "first: rover-t2-c1"]),
    ([*TRAIN, "--sedes", "3"], ["unknown option --sedes", "--seeds"]),
    ([*TRAIN, "--algorithm.popluation", "9"], ["--algorithm.popluation", "nearest: --algorithm.population"]),
    ([*TRAIN, "--algorithm.skills", "go_to_pio_A"], ["'go_to_pio_A'", "first: go_to_poi_A"]),
    ([*TRAIN, "--environment.spatial-coupling", "2"], ["spatial_coupling = 2", "n_agents = 1"]),
    ([*TRAIN, "--environment.parents", "A:B,B:A"], ["cycle", "A, B"]),
    ([*TRAIN, "--environment.parents", "B:Q"], ["'Q'"]),
    ([*TRAIN, "--environment.parents", "B>A"], ["B>A", "TYPE:PARENT"]),
    ([*TRAIN, "--environment.simultaneous", "A,B"], ["a group needs at least two types"]),
    ([*TRAIN, "--environment.simultaneous", "A&B"], ["'A&B'", "TYPE+TYPE"]),
    # Of a preset that has groups, which tyro by itself takes for options of their own.
    (
        ["train", "madys", "rover-t4-c3-simultaneous", "--environment.simultaneous", "A+E"],
        ["unknown POI type in simultaneous 'E'; valid, nearest first: A, B, C, D"],
    ),
    # Of a preset that has types of rovers, likewise.
    (
        ["train", "madys", "rover-t2-crew", "--environment.rover-types", "scout:rovers=1:coupling=2"],
        ["rover type scout: coupling = 2: above rovers = 1"],
    ),
    ([*TRAIN, "--environment.rover-types", "scout:rover=2"], ["unknown field of scout 'rover'", "rovers"]),
    ([*TRAIN, "--environment.simultaneous", "A+B"], ["2 rovers at once", "n_agents = 1"]),
    ([*TRAIN, "--environment.order", "drawn", "--environment.parents", "none"], ["leave out parents"]),
    ([*TRAIN, "--environment.episode-length", "0"], ["episode_length = 0"]),
    ([*TRAIN, "--environment.n-agents", "-1"], ["n_agents = -1"]),
    ([*TRAIN, "--environment.world-size", "-3"], ["world_size = -3"]),
    ([*TRAIN, "--algorithm.population", "0"], ["population = 0"]),
    ([*TRAIN, "--skills-from", "nowhere"], ["skills_from = nowhere: nowhere: no such run folder"]),
    ([*TRAIN, "--team-from", "nowhere"], ["team_from = nowhere: nowhere: no such run folder"]),
    ([*TRAIN, "--skills-frozen"], ["skills_frozen = True: no skills are taken over"]),
    ([*TRAIN, "--algorithm.population", "5"], ["population = 5", "elites + 2 = 6"]),
    ([*TRAIN, "--algorithm.updates", "3"], ["updates = 3", "policy_delay"]),
    ([*TRAIN, "--algorithm.buffer-capacity", "10"], ["buffer_capacity = 10", "raise it"]),
    ([*TRAIN, "--algorithm.learner.batch-size", "0"], ["batch_size = 0"]),
    ([*TRAIN, "--algorithm.selector.hidden", "0"], ["hidden = (0,)"]),
    ([*TRAIN, "--algorithm.selector.hidden", "1e18"], ["hidden = (1000000000000000000,)", "at most 8192"]),
    ([*TRAIN, "--algorithm.selector.memory", "1e18"], ["memory = 1000000000000000000", "up to 8192"]),
    ([*TRAIN, "--algorithm.population", "1e9"], ["needs about", "GiB", "--algorithm.population"]),
    ([*TRAIN, "--score-episodes", "1e18"], ["score_episodes = 1000000000000000000", "at most 1000000"]),
    ([*TRAIN, "--report-episodes", "1e18"], ["report_episodes = 1000000000000000000", "to 1000000"]),
    ([*TRAIN, "--generations-per-report", "1e18"], ["generations_per_report = 1", "at most 1000000"]),
    ([*TRAIN, "--out", "x" * 300], ["xxx: cannot be written, file name too long"]),
    (["train", "ea", f"{'x' * 300}.py:World"], ["no file", "xxx.py"]),
    (["train", "ea", "~nobody-of-that-name/world.py:World"], ["no file", "~nobody-of-that-name"]),
    (["evaluate", "x" * 300], ["xxx: no such run folder"]),
    (["evaluate", "no\nfolder"], ["no\\nfolder: no such run folder"]),
    ([*TRAIN, "--algorithm.selector.phases", "51"], ["selector.phases = 51", "50 steps", "at most 50"]),
    ([*TRAIN, "--algorithm.evolution.phases.skill", "4"], ["phases.skill = 4", "between 0 and 1"]),
    ([*TRAIN, "--seeds", "many"], ["--seeds many", "2000..2004"]),
    ([*TRAIN, "--seeds", "0"], ["at least one"]),
    ([*TRAIN, "--seeds", "5..3"], ["--seeds 5..3"]),
    ([*TRAIN, "--seeds", "1,1"], ["each once"]),
    ([*TRAIN, "--seeds", "1,,2"], ["--seeds 1,,2"]),
    ([*TRAIN, "--seeds", "4294967296,"], ["seeds"]),
    ([*TRAIN, "--steps", "4.5"], ["'4.5'", "whole number"]),
    ([*TRAIN, "--steps", "lots"], ["'lots'", "5e5"]),
    ([*TRAIN, "--steps", "1e999"], ["'1e999'"]),
    ([*TRAIN, "--steps", "0"], ["steps = 0"]),
    ([*TRAIN, "--keep", "0"], ["keep = 0"]),
    ([*TRAIN, "--report-episodes", "0"], ["episodes = 0"]),
    ([*TRAIN, "--out", "/dev/null/run"], ["/dev/null/run", "cannot be written"]),
    ([*TRAIN, "--out", "."], ["exists and is never overwritten"]),
    (["train", "--config"], ["configuration file"]),
    (["train", "--config", "missing.yaml"], ["missing.yaml", "cannot be read"]),
    (["resume"], ["RUN is missing"]),
    (["resume", "nowhere"], ["nowhere: no such run folder"]),
    (["resume", "."], ["not a run folder"]),
    (["evaluate"], ["RUN is missing"]),
    (["evaluate", "nowhere"], ["no such run folder"]),
    (["evaluate", "."], ["not a run folder"]),
    (["evaluate", "nowhere", "--epsiodes", "5"], ["unknown option --epsiodes", "--episodes"]),
    (["report", "nowhere"], ["no such run folder"]),
    ([*TRAIN, "--out", "M\udcfcller"], ["'M\\udcfcller': not written in UTF-8; rename it"]),
    (["list", "--jsno"], ["unknown option --jsno", "--json"]),
]


@pytest.mark.parametrize(("words", "expected"), MISTAKES, ids=lambda value: " ".join(value))
@pytest.mark.usefixtures("never_trains")
def test_a_mistake_is_one_line_and_exit_code_2(words, expected, capsys, tmp_path):
    assert call(words) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    # What training says before it begins is no part of the complaint.
    lines = [line for line in captured.err.splitlines() if not line.startswith(("madys on ", "Needs about "))]
    assert len(lines) == 1, captured.err
    assert lines[0].startswith("skillcrew: ")
    for part in expected:
        assert part in lines[0]
    assert not list(tmp_path.iterdir()), "something was left behind"


@pytest.mark.parametrize(
    "words",
    [
        [*TRAIN, "--algorithm.plateau.window", "[1]"],
        [*TRAIN, "--checkpoint-seconds", "soon"],
        [*TRAIN, "--environment.sensor", "dense"],
        [*TRAIN, "--environment.bounded", "7"],
        [*TRAIN, "stray"],
        [*TRAIN, "--seeds"],
        ["evaluate", "nowhere", "--episodes"],
    ],
    ids=" ".join,
)
@pytest.mark.usefixtures("never_trains")
def test_a_value_of_the_wrong_type_is_exit_code_2(words, capsys):
    assert call(words) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    lines = captured.err.splitlines()
    assert len(lines) == 1 and lines[0].startswith("skillcrew: "), captured.err
    assert words[-1] in lines[0] and "│" not in lines[0] and "\\x1b" not in lines[0], lines[0]


@pytest.mark.parametrize("words", [["resume"], ["evaluate"], ["report"]], ids=" ".join)
@pytest.mark.parametrize(("option", "value", "expected"), [("--checkpoint", "12345", "no checkpoint 12345")])
def test_a_checkpoint_that_is_not_there(words, option, value, expected, copied, capsys):
    before = tiny.contents(copied)
    assert call([*words, str(copied), option, value]) == 2
    captured = capsys.readouterr()
    assert captured.out == "" and expected in captured.err and captured.err.count("\n") == 1
    assert tiny.contents(copied) == before


def test_zero_episodes_are_refused_before_any_work(copied, capsys):
    for words in (["evaluate", "--episodes"], ["report", "--episodes"], ["resume", "--report-episodes"]):
        assert call([words[0], str(copied), words[1], "0"]) == 2
        captured = capsys.readouterr()
        assert captured.out == "" and "episodes = 0" in captured.err
        assert len([line for line in captured.err.splitlines() if line.startswith("skillcrew: ")]) == 1
    assert not (copied / "report").exists()


@pytest.mark.parametrize(
    ("text", "seeds"),
    [
        ("5", (0, 1, 2, 3, 4)),
        ("2000..2004", (2000, 2001, 2002, 2003, 2004)),
        ("1,5,9", (1, 5, 9)),
        ("7,", (7,)),
    ],
)
def test_seeds_are_a_count_a_range_or_a_list(text, seeds, no_training):
    assert call([*TRAIN, "--seeds", text]) == 0
    assert tuple(no_training[0][1].seeds) == seeds


def test_every_option_arrives(no_training):
    words = [*TRAIN, "--steps", "4e6", "--out", "here", "--keep", "3", "--no-save-buffer"]
    words += [
        "--algorithm.population",
        "6e1",
        "--algorithm.evolution.elites=7",
        "--algorithm.selector.hidden",
    ]
    words += ["5", "6", "--environment.n-agents", "2", "--environment.parents", "none"]
    words += ["--algorithm.learner.batch_size", "32", "--environment.sensor", "closest"]
    assert call(words) == 0
    (algorithm, options), *_ = no_training
    assert options.steps == 4_000_000 and str(options.out) == "here" and options.keep == 3
    assert options.save_buffer is False
    assert algorithm.config.population == 60 and algorithm.config.evolution.elites == 7
    assert algorithm.config.selector.hidden == (5, 6) and algorithm.config.learner.batch_size == 32
    assert algorithm.env.config.n_agents == 2 and dict(algorithm.env.config.parents) == {}
    assert algorithm.env.config.sensor == "closest" and algorithm.env.name == "rover-t2-c1"


def test_groups_of_types_arrive(no_training):
    words = ["train", "madys", "rover-t3-c3", "--environment.simultaneous", "A+C"]
    assert call([*words, "--environment.poi-speed", "0.25"]) == 0
    (algorithm, _), *_ = no_training
    assert algorithm.env.config == dataclasses.replace(
        PRESETS["rover-t3-c3"], simultaneous=(("A", "C"),), poi_speed=0.25
    )


def test_runs_to_begin_with_arrive(no_training, tmp_path):
    words = ["--skills-from", "runs/t2", "--skills-frozen", "--team-from", "runs/six", "--trust"]
    assert call([*TRAIN, *words]) == 0
    (algorithm, options), *_ = no_training
    begun = {"skills_from": Origin("runs/t2", 340, "ab", 9), "team_from": Origin("runs/six")}
    given = (options.skills_from, options.skills_frozen, options.team_from, options.trust)
    assert given == (Origin("runs/t2"), True, Origin("runs/six"), True)
    # Fed back, a configuration begins with the very checkpoint that it knows, or with another run if told so.
    file = tmp_path / "c.yaml"
    file.write_text(to_yaml(algorithm, RunConfig(**begun)))
    assert call(["train", "--config", str(file), "--team-from", "none"]) == 0
    assert (no_training[1][1].skills_from, no_training[1][1].team_from) == (begun["skills_from"], None)


def test_no_options_mean_the_defaults_of_the_library(no_training):
    assert call(TRAIN) == 0
    (algorithm, options), *_ = no_training
    assert algorithm.config == sc.MADyS(algorithm.env).config
    assert algorithm.env.config == PRESETS["rover-t2-c1"]
    assert RunConfig(tuple(options.seeds), options.steps, **options.run_config()) == RunConfig()


def test_a_configuration_file_says_the_same_again(finished, no_training):
    assert call(["train", "--config", str(finished / "config.yaml")]) == 0
    (algorithm, options), *_ = no_training
    run = RunConfig(tuple(options.seeds), options.steps, **options.run_config())
    assert to_yaml(algorithm, run) == (finished / "config.yaml").read_text()
    assert call(["train", "--config", str(finished / "config.yaml"), "--steps", "1e5"]) == 0
    assert no_training[1][1].steps == 100_000 and tuple(no_training[1][1].seeds) == tiny.SEEDS


def test_evaluate_prints_each_seed_and_the_mean(finished, capsys):
    assert call(["evaluate", str(finished), "--episodes", "20"]) == 0
    captured = capsys.readouterr()
    lines = captured.out.splitlines()
    assert [line.split()[:2] for line in lines[:2]] == [["seed", str(seed)] for seed in tiny.SEEDS]
    assert lines[2].startswith("success") and "20 fresh episodes per seed" in lines[2]
    assert captured.err == ""


def test_evaluate_as_json(finished, capsys):
    assert call(["evaluate", str(finished), "--episodes", "20", "--json"]) == 0
    captured = capsys.readouterr()
    assert captured.err == ""
    printed = json.loads(captured.out)
    assert {"success_rate", "episodes"} <= set(printed) and printed["episodes"] == 20
    rate = printed["success_rate"]
    assert set(rate) == {"mean", "low", "high", "per_seed"}
    expected = sc.Run(finished).evaluate(20)
    assert rate["mean"] == expected.success_rate.mean
    assert 0 <= rate["low"] <= rate["mean"] <= rate["high"] <= 1
    assert [entry["seed"] for entry in rate["per_seed"]] == list(tiny.SEEDS)
    assert [entry["mean"] for entry in rate["per_seed"]] == expected.returns.mean(1).tolist()


def test_json_is_strict_where_an_interval_is_unknown():
    evaluation = sc.Evaluation(
        (0, 1), 2, np.asarray([[1.0, np.nan], [0.0, 1.0]]), np.zeros((2, 2, 1, 1), int)
    )
    evaluation = sc.Evaluation((0,), 2, evaluation.returns[1:], evaluation.choices[1:])
    json.loads(
        json.dumps(evaluation.as_dict()), parse_constant=lambda name: pytest.fail(f"{name} is no JSON")
    )


def test_report_as_json(copied, capsys, tmp_path):
    out = tmp_path / "figures"
    assert call(["report", str(copied), "--episodes", "20", "--out", str(out), "--json"]) == 0
    captured = capsys.readouterr()
    assert captured.err == ""
    written = json.loads(captured.out)["written"]
    assert sorted(written) == sorted(str(path) for path in out.iterdir()) and written


def test_a_page_of_several_runs(copied, capsys, tmp_path, monkeypatch):
    caught = []
    monkeypatch.setattr(report_command, "write_reports", lambda *given: caught.append(given) or [given[-1]])
    assert (
        call(["report", str(copied), str(copied), "--episodes", "20", "--out", str(tmp_path / "both")]) == 0
    )
    runs, evaluations, folder = caught[0]
    assert [run.folder.path for run in runs] == [copied, copied] and folder == tmp_path / "both"
    assert [evaluation.episodes for evaluation in evaluations] == [20, 20]
    capsys.readouterr()
    assert call(["report", str(copied), str(copied), "--checkpoint", "1"]) == 2
    assert "--checkpoint 1: is of one run; give one RUN" in capsys.readouterr().err


def test_a_run_whose_metrics_are_lost_is_taken_to_its_end(copied, capsys, monkeypatch):
    (copied / "metrics.parquet").unlink()
    monkeypatch.setattr("skillcrew.cli.conclusion.write_report", lambda *_: [copied / "report.html"])
    assert call(["resume", str(copied), "--report-episodes", "4"]) == 0
    captured = capsys.readouterr()
    assert "metrics.parquet is gone, and with it all rows" in captured.err
    assert "on 4 fresh episodes per seed" in captured.out


def test_list_as_text_and_as_json(capsys):
    assert call(["list"]) == 0
    text = capsys.readouterr().out
    assert call(["list", "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert set(printed) == {"algorithms", "environments", "broken"}
    assert "madys" in printed["algorithms"] and set(printed["environments"]) == set(registry.names())
    assert printed["environments"]["rover-t3-c2"]["n_agents"] == 4
    assert "go_to_agent" in printed["environments"]["rover-t3-c2"]["skills"]
    for name in ("madys", *registry.names(), "go_away_from_poi_C"):
        assert name in text
    said = {line.split()[0]: line for line in text.splitlines() if line.startswith("  rover")}
    assert said["rover-t3-c3"].endswith("70 steps")
    assert said["rover-t4-c3-breakdown"].endswith("45 steps, A+B then C+D at once, 1 breaks down")
    assert said["rover-t3-c3-drawn"].endswith("30 steps, order drawn")
    assert said["rover-t2-c2-moving"].endswith("25 steps, POIs move")


def test_the_installed_command_in_a_process_of_its_own(finished):
    process = tiny.start_command("evaluate", str(finished), "--episodes", "20", "--json")
    output, errors = process.communicate(timeout=300)
    assert (process.returncode, errors) == (0, "")
    assert json.loads(output)["success_rate"]["mean"] == sc.Run(finished).evaluate(20).success_rate.mean
    missing = tiny.start_command("evaluate", "nowhere")
    output, errors = missing.communicate(timeout=300)
    assert (missing.returncode, output) == (2, "")
    assert errors == "skillcrew: nowhere: no such run folder; `skillcrew train` makes one\n"


def test_a_reader_that_has_gone_is_no_error():
    done = subprocess.run(
        f'{sys.executable} -c "from skillcrew.cli.main import main; main()" list --json | head -n 1',
        shell=True,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stdout == "{\n"
    assert done.stderr == ""


def test_a_machine_that_has_no_memory_left_is_one_line(monkeypatch, capsys):
    def too_much(_):
        return jax.jit(lambda: jnp.zeros((2**20, 2**24)))()

    monkeypatch.setattr("skillcrew.cli.evaluate.run", too_much)
    assert call(["evaluate", "run"]) == 2
    line = capsys.readouterr().err
    assert line.startswith("skillcrew: the machine has no memory left, and what a run has saved is kept; ")
    assert line.count("\n") == 1

    def other_trouble(_):
        raise RuntimeError("out of luck")

    monkeypatch.setattr("skillcrew.cli.evaluate.run", other_trouble)
    with pytest.raises(RuntimeError, match="luck"):
        call(["evaluate", "run"])


@pytest.mark.parametrize("words", [("train", 'a"b', "rover-t2-c1"), ("report", "it's"), ("evaluate", 'r"un')])
def test_names_with_quotes_are_names(words, capsys):
    call([*words, "--help"])
    call([*words, "--nonsense"])
    assert "Traceback" not in capsys.readouterr().err


def test_export_writes_a_team_into_a_new_folder(finished, tmp_path, capsys):
    assert call(["export", str(finished), "--out", "team", "--formats", "onnx,safetensors", "--json"]) == 0
    written = json.loads(capsys.readouterr().out)["written"]
    assert sorted(written) == sorted(f"team/{path.name}" for path in (tmp_path / "team").iterdir())
    assert json.loads((tmp_path / "team" / "team.json").read_text())["seed"] == tiny.SEEDS[0]
    assert sc.load_team("team").n_agents == 2


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["--out", "taken"], "taken: exists and is never overwritten; choose another folder with --out"),
        (["--out", "file/team"], "file/team: cannot be written, not a directory"),
        (["--out", "/proc/team"], "/proc/team: cannot be written, "),
        (["--seed", "4"], "seed 4: not of this run, which has 3, 11"),
        (["--formats", "onix"], "unknown format 'onix'; valid, nearest first: onnx, "),
        (["--formats", "safetensors,"], "unknown format ''; valid, nearest first: "),
        (["--checkpoint", "99999"], "no checkpoint 99999; there are "),
    ],
)
def test_an_export_that_cannot_be_is_refused_in_one_line(words, line, finished, tmp_path, capsys):
    (tmp_path / "taken").mkdir()
    (tmp_path / "file").write_text("")
    assert call(["export", str(finished), *words]) == 2
    said = capsys.readouterr().err
    assert line in said
    assert said.count("\n") == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "taken"]


def test_a_run_without_champions_has_none_to_export(copied, capsys):
    shutil.rmtree(copied / "checkpoints")
    assert call(["export", str(copied), "--out", "team"]) == 2
    said = capsys.readouterr().err
    assert "holds no finished checkpoint; wait for the first one, " in said
    assert f"if nothing trains there, `skillcrew resume {copied}`" in said


def test_onnx_without_its_package_is_refused_or_left_out(finished, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "onnx", None)
    assert call(["export", str(finished), "--out", "team", "--formats", "onnx"]) == 2
    assert "formats = onnx: needs the package onnx, pip install 'skillcrew[onnx]'" in capsys.readouterr().err
    assert call(["export", str(finished), "--out", "team"]) == 0
    said = capsys.readouterr()
    assert (
        said.err == "skillcrew: onnx is left out: pip install 'skillcrew[onnx]' brings the package it needs\n"
    )
    assert "team/team.stablehlo" in said.out and "onnx" not in said.out
