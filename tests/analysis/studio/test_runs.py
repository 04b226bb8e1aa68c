"""The table: what each run is at, whatever its folder holds."""

import json
import os
import shutil
import sys

import pytest

from analysis.studio.asking import listening
from analysis.studio.folders import EVIL, STEPS, grow, write_run
from skillcrew.analysis.studio import glance
from skillcrew.experiment.ownership import owned


def test_each_run_with_how_far_it_is_and_what_it_reached(studio, root):
    write_run(root / "new")
    write_run(root / "half", 0.5)
    write_run(root / "comparison" / "runs" / "whole", 1.0)
    rows = studio.runs()
    assert {name: (row["state"], row["steps"], row["score"]) for name, row in rows.items()} == {
        "new": ("stopped", 0, ""),
        "half": ("stopped", STEPS // 2, "0.500"),
        "comparison/runs/whole": ("done", STEPS, "1.000"),
    }
    half = rows["half"]
    assert (half["algorithm"], half["environment"]) == ("madys", "meadow")
    assert (half["seeds"], half["budget"], half["word"], half["page"]) == (2, STEPS, "success", None)
    assert "nobody_imports_this" not in sys.modules


def test_it_follows_what_happens(studio, root):
    assert studio.runs() == {}
    run = write_run(root / "run", 0.25)
    assert studio.runs()["run"]["steps"] == STEPS // 4
    grow(run, 0.75)
    assert studio.runs()["run"]["steps"] == 3 * STEPS // 4
    shutil.rmtree(run)
    assert studio.runs() == {}
    shutil.rmtree(root)
    assert studio.runs() == {}


def test_what_trains_comes_first_and_says_how_fast(studio, root):
    write_run(root / "a", 1.0)
    run = write_run(root / "b", 0.25)
    os.utime(run / "metrics.parquet", (1000, 1000))
    (run / "timing.json").write_text('[{"compile_seconds": 3.0}]')
    os.utime(run / "timing.json", (950, 950))
    with owned(run):
        rows = studio.runs()
        assert list(rows) == ["b", "a"] and rows["b"]["state"] == "training"
        assert rows["b"]["rate"] == 2 * STEPS / 4 / 50, "of both seeds, since it was compiled"
        grow(run, 0.75)
        os.utime(run / "metrics.parquet", (1010, 1010))
        assert studio.runs()["b"]["rate"] == 2 * STEPS / 2 / 10, "since the rows before"
    assert studio.runs()["b"]["state"] == "stopped" and studio.runs()["b"]["rate"] is None


def test_a_lock_whose_owner_was_killed_is_tried_once(studio, root, monkeypatch):
    run = write_run(root / "run", 0.5)
    (run / "owner.lock").write_text("process 1 on elsewhere")
    tried = []
    real = glance.holder
    monkeypatch.setattr(glance, "holder", lambda folder: tried.append(folder) or real(folder))
    assert [studio.runs()["run"]["state"] for _ in range(3)] == ["stopped"] * 3
    assert len(tried) == 1


def test_final_scores_stand_in_the_place_of_the_last_generation(studio, root):
    run = write_run(root / "run", 1.0)
    (run / "report").mkdir()
    scores = {"episodes": 9, "success_rate": {"mean": 0.75, "low": 0.5, "high": 0.875}}
    (run / "report" / "scores.json").write_text(json.dumps(scores))
    assert studio.runs()["run"]["score"] == "0.750 [0.500, 0.875]"
    (run / "report" / "scores.json").write_text("[")
    assert studio.runs()["run"]["score"] == "1.000"


def cut_metrics(run):
    whole = (run / "metrics.parquet").read_bytes()
    (run / "metrics.parquet").write_bytes(whole[: len(whole) // 2])


def write_config(text):
    return lambda run: (run / "digests.json").unlink() or (run / "config.yaml").write_text(text)


def put_pipe(run):
    (run / "config.yaml").unlink()
    os.mkfifo(run / "config.yaml")


def lead_out(run):
    (run / "digests.json").unlink()
    (run / "config.yaml").rename(run.parents[1] / "secret.yaml")
    (run / "config.yaml").symlink_to(run.parents[1] / "secret.yaml")


def metrics_of_a_folder(run):
    (run / "metrics.parquet").unlink()
    (run / "metrics.parquet").mkdir()


DAMAGED = {
    "metrics that are cut": (cut_metrics, "metrics.parquet: damaged"),
    "a configuration of something else": (write_config("a: 1"), "not the configuration of a run"),
    "no YAML": (write_config("a: b: c"), "cannot be read as YAML"),
    "an unknown field": (
        write_config("algorithm: {name: a}\nenvironment: {name: b}\nrun: {evil: 1}"),
        "unknown field",
    ),
    "a name that is none": (write_config("algorithm: {name: [1]}"), "names no algorithm"),
    "a large configuration": (write_config("#" * 2_000_000), "too large"),
    "a pipe": (put_pipe, "is no file"),
    "a link that leads out": (lead_out, "leads out of"),
    "metrics that are a folder": (metrics_of_a_folder, "is no file"),
    "digests that are cut": (lambda run: (run / "digests.json").write_text("{"), "digests.json: damaged"),
}


@pytest.mark.parametrize(("damage", "said"), DAMAGED.values(), ids=DAMAGED)
def test_damage_is_a_line_of_the_table(damage, said, studio, root):
    run = write_run(root / "run", 0.5)
    write_run(root / "sound", 0.5)
    damage(run)
    rows = studio.runs()
    assert rows["run"]["state"] == "damaged" and said in rows["run"]["trouble"]
    assert "\n" not in rows["run"]["trouble"] and rows["sound"]["state"] == "stopped"
    drawn = studio.curves("run", "sound")
    assert [curve["label"] for panel in drawn["panels"] for curve in panel["curves"]] == ["sound"]
    assert drawn["missing"][0][0] == "run"


def test_whatever_a_reader_raises_is_a_line_too(studio, root, monkeypatch):
    def breaks(*_):
        raise OverflowError("as no one expected")

    write_run(root / "run", 0.5)
    monkeypatch.setattr(glance, "read_scores", breaks)
    assert "OverflowError: as no one expected" in studio.runs()["run"]["trouble"]
    assert "as no one expected" in studio.curves("run")["missing"][0][1]


def test_links_and_hidden_folders_are_left_alone(studio, root, tmp_path):
    write_run(tmp_path / "elsewhere" / "run", 0.5)
    (root / "away").symlink_to(tmp_path / "elsewhere")
    (root / "direct").symlink_to(tmp_path / "elsewhere" / "run")
    (root / "round").symlink_to(root)
    write_run(root / ".half.123", 0.5)
    assert studio.runs() == {}


def test_names_may_be_anything(studio, root):
    names = (EVIL, "a b&run=c", "ü\u2028", os.fsdecode(b"\xff"))
    for name in names:
        # Nothing can be written under a name that is no text; it can be called that later.
        write_run(root / "first", 0.5, environment=EVIL).rename(root / name)
    rows = studio.runs()
    assert set(rows) == {EVIL, "a b&run=c", "ü\\u2028", "\\udcff"}
    assert len(studio.curves(*rows)["panels"][0]["curves"]) == len(names)


def test_what_has_not_changed_is_not_read_again(studio, root, monkeypatch):
    for number in range(30):
        write_run(root / f"run-{number}", 0.5)
    while any(row["state"] == "reading" for row in studio.runs().values()):
        pass
    read = []
    real = glance.read_scores
    monkeypatch.setattr(glance, "read_scores", lambda path: read.append(path) or real(path))
    grow(root / "run-7", 0.75)
    assert studio.runs()["run-7"]["steps"] == 3 * STEPS // 4
    assert [path.parent.name for path in read] == ["run-7"]


def test_nobody_waits_until_all_is_read(studio, root, monkeypatch):
    monkeypatch.setattr("skillcrew.analysis.studio.studio.PATIENCE", -1.0)
    for number in range(3):
        write_run(root / f"run-{number}", 0.5)
    assert [row["state"] for row in studio.runs().values()] == ["reading"] * 3


def test_a_run_itself_is_shown_alone(root, tmp_path_factory):
    run = write_run(root / "run", 0.5)
    write_run(run / "checkpoints" / "no run", 0.5)
    with listening(run, tmp_path_factory.mktemp("scratch")) as client:
        assert list(client.runs()) == ["run"]
