"""Records have what metrics.parquet has, each generation once, and never cost a run."""

import importlib.util
import os

import pytest

import skillcrew as sc
from experiment import tiny
from experiment.trackers.conftest import CONFIGURATION, SEEDS
from skillcrew.experiment.config import RunConfig
from skillcrew.experiment.trackers.tracking import Tracking

OPTIONS = {"score_episodes": 3, "generations_per_report": 2, "checkpoint_seconds": 0.0}


def trained(folder, counting, **options):
    return sc.train(counting, SEEDS, 150, folder, **OPTIONS, **options)


def generations(run):
    columns = run.metrics()
    return {seed: columns["generation"][columns["seed"] == seed].tolist() for seed in SEEDS}


@pytest.fixture
def absent(monkeypatch):
    """Makes a package one that is not installed."""
    find = importlib.util.find_spec

    def absent(package):
        monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == package else find(name))

    return absent


@pytest.mark.parametrize(
    ("names", "said"), [(("tensorbord",), "nearest first: tensorboard"), (("wandb", "wandb"), "each once")]
)
def test_names_that_are_none_are_refused(names, said):
    with pytest.raises(sc.UserError, match=said):
        RunConfig(trackers=names)


def test_nothing_is_made_where_a_tracker_is_not_installed(absent, counting, tmp_path):
    absent("wandb")
    with pytest.raises(sc.UserError, match=r"wandb is not installed; pip install 'skillcrew\[tracking\]'"):
        trained(tmp_path / "run", counting, trackers=("wandb",))
    assert not list(tmp_path.iterdir())


def test_a_folder_of_that_name_is_no_package(monkeypatch, tmp_path):
    (tmp_path / "tensorbored").mkdir()
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr("skillcrew.experiment.trackers.tracking.check_names", lambda names: None)
    with pytest.raises(sc.UserError, match="tensorbored is not installed"):
        Tracking(("tensorbored",), print)


def test_each_generation_is_recorded_once_however_often_a_run_is_stopped(memory, counting, tmp_path):
    stops = tiny.InterruptAfter(2, lambda: os.kill(os.getpid(), 2))
    with pytest.raises(sc.Interrupted):
        trained(tmp_path / "run", counting, reporter=stops, trackers=("json",))
    assert max(memory.told[3]) == 4
    run = sc.Run(tmp_path / "run", counting.env).resume()
    assert memory.told == generations(run)
    assert memory.told[3] == list(range(1, memory.told[3][-1] + 1)) and memory.told[3][-1] > 8
    assert memory.closed == 2


def test_trackers_leave_the_bits_as_they_are(memory, counting, tmp_path):
    trained(tmp_path / "with", counting, trackers=("json",))
    trained(tmp_path / "without", counting)
    tiny.assert_same_ending(tmp_path / "with", tmp_path / "without", counting)
    assert not (tmp_path / "without" / "json").exists()


def test_a_run_goes_on_where_its_tracker_is_not_installed_and_the_gap_is_filled(
    memory, absent, monkeypatch, counting, tmp_path
):
    trained(tmp_path / "run", counting, trackers=("json",))
    recorded = memory.told[3][-1]
    with monkeypatch.context() as patch:
        patch.setattr(importlib.util, "find_spec", lambda name: None)
        reporter = tiny.InterruptAfter(-1, None)
        run = sc.Run(tmp_path / "run", counting.env).resume(300, reporter)
        assert memory.told[3][-1] == recorded
        assert sum("json is not installed" in line for line in reporter.notes) == 1
        with pytest.raises(sc.UserError, match="not installed"):
            run.resume(trackers=("json",))
    # Nothing is left to train, and that there is one now is noticed.
    sc.Run(tmp_path / "run", counting.env).resume()
    assert memory.told == generations(run)


def test_a_tracker_that_fails_says_so_once_and_the_run_goes_on(memory, counting, tmp_path):
    memory.fails_at = 3
    reporter = tiny.InterruptAfter(-1, None)
    run = trained(tmp_path / "run", counting, reporter=reporter, trackers=("json",))
    (said,) = (line for line in reporter.notes if line.startswith("json: "))
    assert said.startswith("json: no space\\nleft. The run goes on without this record; ")
    assert memory.told[3] == [1, 2] and generations(run)[3][-1] > 8
    assert memory.closed == 1
    memory.fails_at = None
    sc.Run(tmp_path / "run", counting.env).resume()
    assert memory.told == generations(run)


def refused(folder):
    """The one note that a tracker gives whose place in a run folder is taken; nothing there is changed."""
    before, notes = tiny.contents(folder), []
    Tracking(("json",), notes.append).open(folder, CONFIGURATION, SEEDS)
    assert tiny.contents(folder) == before
    (note,) = notes
    return note


@pytest.mark.parametrize(
    "text",
    [
        "{",
        "[1]",
        '{"identity": "../../x", "generation": 1}',
        '{"identity": "01234567", "generation": "1"}',
        '{"identity": "01234567", "code": 1}',
    ],
)
def test_what_is_no_record_is_not_touched(text, memory, tmp_path):
    (tmp_path / "json").mkdir()
    (tmp_path / "json" / "recorded.json").write_text(text)
    assert f"recorded.json: damaged; delete {tmp_path / 'json'} to record anew" in refused(tmp_path)


def test_a_link_is_not_followed(memory, tmp_path):
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "json").symlink_to("elsewhere")
    assert "a link, and what it leads to would be changed" in refused(tmp_path)


def test_a_file_is_in_the_way(memory, tmp_path):
    (tmp_path / "json").write_text("")
    assert "File exists" in refused(tmp_path)
