"""What `skillcrew show` says of a run folder, and of one that is damaged."""

import json

import pytest
import yaml

from experiment import made_up
from skillcrew.cli.main import run_command
from skillcrew.experiment import reproduction
from skillcrew.experiment.folder import RunFolder
from skillcrew.experiment.integrity import write_known

HEIGHTS = {2000: 0.5, 2001: 0.875}


@pytest.fixture
def folder(tmp_path, monkeypatch) -> RunFolder:
    """A run without champions: training is over, and nothing has been scored yet."""
    made_up.shrink(monkeypatch)
    (planned, *_) = reproduction.plan(["rover-t2-c1"], seeds=tuple(HEIGHTS))
    where = RunFolder(tmp_path / "run")
    made_up.write_run(where, planned, HEIGHTS)
    return where


def show(folder: RunFolder, capsys, *words: str) -> str:
    assert run_command(["show", str(folder.path), *words]) == 0
    return capsys.readouterr().out


def test_it_says_how_far_each_seed_is_and_every_option(folder, capsys) -> None:
    said = show(folder, capsys).splitlines()
    assert said[0] == str(folder.path)
    assert said[1].split() == ["seed", "2000", "generation", "41", "8.2", "k", "steps", "success", "1.000"]
    assert said[2].split()[:2] == ["seed", "2001"]
    assert not any("  final " in line for line in said)
    assert "  population: 40" in said
    assert "run:" in said


def test_it_says_what_champions_reached_where_they_were_scored(folder, capsys) -> None:
    made_up.write_report(folder, {2000: 10, 2001: 20})
    assert "  final success 0.750 [" in show(folder, capsys)
    found = json.loads(show(folder, capsys, "--json"))
    assert found["scores"]["success_rate"]["mean"] == 0.75
    assert found["progress"][1]["environment_steps"] == 8200
    assert found["configuration"]["algorithm"]["name"] == "madys"


def test_it_says_what_a_run_began_with(folder, capsys) -> None:
    assert json.loads(show(folder, capsys, "--json"))["began_with"] == []
    configuration = yaml.safe_load(folder.config.read_text())
    configuration["run"] |= {
        "skills_from": {"run": "runs/t2", "checkpoint": 340, "digest": "ab", "steps": 1_500_000},
        "skills_frozen": True,
        "team_from": {"run": "runs/six"},
    }
    write_known(folder.config, lambda path: path.write_text(yaml.safe_dump(configuration)))
    cost = "which had cost 1.5 M steps per seed that are not counted here; these skills learn no more"
    said = show(folder, capsys).splitlines()
    assert f"  began with skills of runs/t2 (generation 340), {cost}" in said
    assert "  began with team of runs/six" in said
    assert json.loads(show(folder, capsys, "--json"))["began_with"][1] == "began with team of runs/six"
    configuration["run"]["skills_from"]["digset"] = 3
    write_known(folder.config, lambda path: path.write_text(yaml.safe_dump(configuration)))
    assert run_command(["show", str(folder.path)]) == 2
    assert "digset" in capsys.readouterr().err


def test_a_run_that_has_just_begun_has_no_generation(folder, capsys) -> None:
    folder.metrics.unlink()
    assert "no generation is over yet" in show(folder, capsys)


@pytest.mark.parametrize(
    "text", ["[]", "{", '{"success_rate": {"mean": "x", "low": 0, "high": 1}, "episodes": 20}', "[" * 5000]
)
def test_scores_that_are_none_are_named(folder, capsys, text: str) -> None:
    folder.report.mkdir()
    folder.scores.write_text(text)
    assert run_command(["show", str(folder.path)]) == 2
    assert f"{folder.scores}: damaged" in capsys.readouterr().err


def test_a_configuration_that_was_changed_is_named(folder, capsys) -> None:
    folder.config.write_text(folder.config.read_text() + "\n# mine\n")
    assert run_command(["show", str(folder.path)]) == 2
    assert f"{folder.config}: " in capsys.readouterr().err
