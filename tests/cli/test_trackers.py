"""`--trackers` as a user meets it."""

import importlib.util

import numpy as np
import pytest
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

import skillcrew as sc
from experiment import tiny
from skillcrew.cli import resume
from skillcrew.cli.main import run_command


def test_a_run_that_has_ended_gets_its_record_with_scores_and_figures(copied, capsys):
    words = ["resume", str(copied), "--trackers", "tensorboard", "--report-episodes", "4", "--quiet"]
    assert run_command(words) == 0
    run = sc.Run(copied)
    assert run.config.trackers == ("tensorboard",)
    columns, seed = run.metrics(), tiny.SEEDS[1]
    rows = columns["seed"] == seed
    events = EventAccumulator(str(copied / "tensorboard" / f"seed-{seed}"), {"scalars": 0}).Reload()
    for name in set(columns) - {"seed"}:
        known = np.isfinite(columns[name][rows])
        points = events.Scalars(name) if known.any() else []
        assert [point.step for point in points] == columns["environment_steps"][rows][known].tolist(), name
        np.testing.assert_allclose([point.value for point in points], columns[name][rows][known], rtol=1e-6)
    (score,) = events.Scalars("final/success_rate")
    assert f"{score.value:.3f}" in capsys.readouterr().out
    for name, file in (("learning_curve", "learning_curve"), ("chosen_skills", f"chosen_skills_seed_{seed}")):
        (image,) = events.Images(name)
        assert image.encoded_image_string == (copied / "report" / f"{file}.png").read_bytes()


@pytest.mark.parametrize(
    ("names", "said"),
    [
        ("tensorbord", "unknown tracker 'tensorbord'; valid, nearest first: tensorboard, wandb"),
        ("wandb,wandb", "give each once"),
        ("tensorboard,wandb", "wandb is not installed; pip install 'skillcrew[tracking]'"),
    ],
)
def test_mistakes_are_told_before_anything_is_made(names, said, monkeypatch, tmp_path, capsys):
    find = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == "wandb" else find(name))
    words = ["train", "ea", "rover-t2-c1", "--out", str(tmp_path / "run"), "--trackers", names]
    assert run_command(words) == 2
    assert said in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_none_is_no_longer(copied, monkeypatch):
    config = copied / "config.yaml"
    (copied / "digests.json").unlink()
    config.write_text(config.read_text().replace("trackers: []", "trackers:\n  - tensorboard"))
    assert sc.Run(copied).config.trackers == ("tensorboard",)
    monkeypatch.setattr(resume, "run_and_report", lambda go, reporter, track, *_: go(track()) and 0)
    run_command(["resume", str(copied), "--trackers", "none", "--quiet"])
    assert sc.Run(copied).config.trackers == () and not (copied / "tensorboard").exists()
