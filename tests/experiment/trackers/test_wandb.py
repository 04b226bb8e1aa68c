"""Weights & Biases is told what it expects: a run for each seed, in one group."""

import pytest

import skillcrew as sc
from experiment.trackers.conftest import CONFIGURATION, SEEDS
from experiment.trackers.test_tensorboard import concluded
from skillcrew.experiment.trackers.tracking import Tracking


@pytest.fixture
def opened(stub, tmp_path):
    folder = tmp_path / "mine"
    folder.mkdir()

    def opened():
        tracking = Tracking(("wandb",), pytest.fail)
        tracking.open(folder, CONFIGURATION, SEEDS)
        return tracking

    return opened


def test_a_run_for_each_seed_in_one_group(stub, opened, grown, tmp_path, monkeypatch):
    monkeypatch.delenv("WANDB_PROJECT", raising=False)
    opened().record(grown(2))
    first, second = (run.given for run in stub.RUNS)
    assert first["name"] == "mine-seed-3" and second["name"] == "mine-seed-11"
    assert first["group"] == second["group"] and first["group"].startswith("mine-")
    assert first["id"] != second["id"] and first["resume"] == "allow" and first["project"] == "skillcrew"
    assert first["config"]["seed"] == 3 and first["config"]["algorithm"] == {"name": "ea", "hidden": [8, 8]}
    assert first["dir"] == str(tmp_path / "mine")
    assert stub.RUNS[1].axes == {"*": "environment_steps"}
    assert stub.RUNS[1].rows == {
        1: {"generation": 1, "environment_steps": 101, "success_rate": 0.01},
        2: {"generation": 2, "environment_steps": 202, "success_rate": 0.02, "loss_A": 1.0},
    }


def test_a_run_that_goes_on_is_the_same_run(stub, opened, grown):
    for generations in (2, 4):
        tracking = opened()
        tracking.record(grown(generations))
        tracking.close()
    before, after = stub.RUNS[0], stub.RUNS[2]
    assert before.given["id"] == after.given["id"] and before.given["group"] == after.given["group"]
    assert list(before.rows) == [1, 2] and list(after.rows) == [3, 4]
    assert [run.finished for run in stub.RUNS] == [1, 1, 1, 1]


def test_scores_and_figures_come_in_the_end(stub, opened, grown, tmp_path):
    tracking = opened()
    tracking.record(grown(2))
    concluded(tracking, grown(2), tmp_path)
    run = stub.RUNS[1]
    assert run.summary["final/success_rate"] == 0.25 and run.summary["final/episodes"] == 4
    assert run.rows[2]["chosen_skills"] == f"image of {tmp_path / 'picture.png'}"
    assert run.rows[2]["environment_steps"] == 202


def test_who_is_not_logged_in_is_told_before_anything_is_made(stub):
    stub.LOGGED_IN[0] = False
    with pytest.raises(
        sc.UserError, match="wandb is not logged in; `wandb login`, or set WANDB_MODE=offline"
    ):
        Tracking(("wandb",), pytest.fail)
    stub.MODE[0] = "offline"
    Tracking(("wandb",), pytest.fail)


def test_a_key_that_is_none_is_told_in_one_line(stub, monkeypatch):
    def login(prompt, verify):
        raise ValueError("API key must have 40+ characters")

    monkeypatch.setattr(stub, "login", login)
    with pytest.raises(sc.UserError, match="wandb cannot be used here: API key must have 40"):
        Tracking(("wandb",), pytest.fail)
    notes = []
    Tracking(("wandb",), notes.append, required=False)
    assert len(notes) == 1 and "The run goes on without this record" in notes[0]
