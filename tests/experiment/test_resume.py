"""A run that was stopped, however roughly, ends in the same bits as one that never was."""

import os
import random
import shutil
import signal
import time

import jax
import numpy as np
import pytest

import skillcrew as sc
from experiment.meeting import Meeting
from experiment.tiny import (
    OPTIONS,
    SEEDS,
    STEPS,
    InterruptAfter,
    assert_same_arrays,
    assert_same_ending,
    contents,
    last_arrays,
    start_command,
    tiny_cerl,
    tiny_ea,
    tiny_madys,
    tiny_mappo,
    tiny_matd3,
    tiny_merl,
    tiny_mfl,
)
from skillcrew.experiment.metrics import read_metrics


def send_interrupt():
    os.kill(os.getpid(), signal.SIGINT)


def fail():
    raise RuntimeError("a bug, or the power")


@pytest.mark.usefixtures("one_program")
def test_stopped_through_ctrl_c_and_then_by_an_error(finished, tmp_path):
    run = tmp_path / "run"
    with pytest.raises(sc.Interrupted):
        sc.train(tiny_madys(), SEEDS, float(STEPS), run, InterruptAfter(1, send_interrupt), **OPTIONS)
    assert read_metrics(run / "metrics.parquet")["generation"].max() == 2
    with pytest.raises(RuntimeError, match="the power"):
        sc.Run(run).resume(reporter=InterruptAfter(2, fail))
    sc.Run(run).resume()
    assert_same_ending(run, finished)
    # The champions that a resumed run hands out are those of its last checkpoint, too.
    team = sc.Run(run).champion(SEEDS[1])
    expected = sc.Run(finished).champion(SEEDS[1])
    for ours, theirs in zip(jax.tree.leaves(team), jax.tree.leaves(expected), strict=True):
        np.testing.assert_array_equal(ours, theirs)


@pytest.mark.usefixtures("one_program")
@pytest.mark.parametrize("make", [tiny_ea, tiny_mfl, tiny_merl, tiny_cerl, tiny_matd3, tiny_mappo])
def test_other_algorithms_resume_to_the_same_bits(make, tmp_path):
    whole, run = tmp_path / "whole", tmp_path / "run"
    # The folder as it is while the second chunk is yet to be saved: what a power cut would leave.
    cut = InterruptAfter(2, lambda: shutil.copytree(whole, run))
    sc.train(make(), SEEDS, 700.0, whole, cut, **{**OPTIONS, "generations_per_report": 3})
    again = sc.Run(run, Meeting())
    assert read_metrics(run / "metrics.parquet")["generation"].max() == 3
    # What its configuration file says is the same algorithm.
    assert (type(again.algorithm), again.algorithm.config) == (type(make()), make().config)
    metrics = again.resume().metrics()
    assert metrics["generation"].max() > 3
    if "pretraining" in metrics:
        assert len(np.unique(metrics["pretraining"])) > 1
    assert_same_ending(run, whole, make())


def test_killed_processes_resume_to_the_same_bits(finished, tmp_path):
    run, draw = tmp_path / "run", random.Random()
    first = start_command("train", "--config", str(finished / "config.yaml"), "--out", str(run))
    wait_for(lambda: any((run / "checkpoints").glob("[0-9]*")), first)
    kill_after(first, draw.uniform(0, 0.5))
    assert not (run / "report").exists(), "it was killed too late to prove anything"
    assert (run / "config.yaml").read_bytes() == (finished / "config.yaml").read_bytes()
    # The second is killed anywhere between starting Python and the end.
    kill_after(start_command("resume", str(run), "--report-episodes", "2"), draw.uniform(0, 8))
    last = start_command("resume", str(run), "--report-episodes", "2")
    output, errors = last.communicate(timeout=300)
    assert last.returncode == 0, errors
    assert "success" in output
    assert_same_ending(run, finished)
    assert not list((run / "checkpoints").glob("*tmp*"))


def test_ctrl_c_saves_exits_with_130_and_says_how_to_resume(finished, tmp_path):
    run = tmp_path / "run"
    process = start_command("train", "--config", str(finished / "config.yaml"), "--out", str(run))
    wait_for(lambda: (run / "metrics.parquet").exists(), process)
    process.send_signal(signal.SIGINT)
    output, errors = process.communicate(timeout=300)
    assert process.returncode == 130, errors
    assert output == ""
    assert f"skillcrew resume {run}" in errors.splitlines()[-1]
    assert "Traceback" not in errors
    saved = read_metrics(run / "metrics.parquet")["generation"].max()
    assert (run / "checkpoints" / str(saved)).is_dir()
    assert saved < read_metrics(finished / "metrics.parquet")["generation"].max()


def test_an_older_checkpoint_leads_to_the_same_end(finished, copied):
    # What the message about a damaged checkpoint advises.
    older = min(int(path.name) for path in (copied / "checkpoints").iterdir())
    sc.Run(copied, checkpoint=older).resume()
    assert_same_ending(copied, finished)


def test_a_finished_run_has_nothing_to_do(finished, copied):
    before, reporter = contents(copied), InterruptAfter(0, fail)
    sc.Run(copied).resume(reporter=reporter)
    assert contents(copied) == before
    assert any("Nothing to do" in note for note in reporter.notes)


def test_no_checkpoint_yet_means_from_the_beginning(counting, tmp_path):
    reference = sc.train(counting, 2, 100.0, tmp_path / "reference", **OPTIONS).folder.path
    run = shutil.copytree(reference, tmp_path / "run")
    shutil.rmtree(run / "checkpoints")
    reporter = InterruptAfter(0, fail)
    sc.Run(run, counting.env).resume(reporter=reporter)
    assert any("from the beginning" in note for note in reporter.notes)
    assert_same_ending(run, reference, counting)


def test_a_larger_budget_ends_as_if_asked_for_at_once(counting, tmp_path):
    budget = 100
    sc.train(counting, 4, 35.0, tmp_path / "run", **OPTIONS)
    extended = sc.Run(tmp_path / "run", counting.env).resume(float(budget))
    at_once = sc.train(counting, 4, float(budget), tmp_path / "at_once", **OPTIONS)
    np.testing.assert_array_equal(extended.champions().generation, at_once.champions().generation)
    assert_same_arrays(extended.metrics(), at_once.metrics())
    assert sc.Run(tmp_path / "run", counting.env).config.steps == budget


def test_a_smaller_budget_is_refused(copied):
    before = contents(copied)
    with pytest.raises(sc.UserError, match=f"less than the run's budget of {STEPS}"):
        sc.Run(copied).resume(STEPS - 1.0)
    assert contents(copied) == before


@pytest.mark.usefixtures("one_program")
def test_without_the_buffer_a_run_goes_on_and_says_what_it_lacks(finished, tmp_path):
    run, reporter = tmp_path / "run", InterruptAfter(1, send_interrupt)
    with pytest.raises(sc.Interrupted):
        sc.train(tiny_madys(), SEEDS, float(STEPS), run, reporter, save_buffer=False, **OPTIONS)
    (kept,) = last_arrays(run)
    assert kept and not any("experience" in name for name in kept)
    assert size(run) < size(finished)
    notes = InterruptAfter(0, fail)
    resumed = sc.Run(run).resume(reporter=notes)
    assert any("no replay buffer" in note for note in notes.notes)
    metrics, reference = resumed.metrics(), sc.Run(finished).metrics()
    # The first generation after the gap fills the buffer anew; the teams that filled it are the same.
    after = metrics["generation"] == 3
    assert (metrics["transitions_held"][after] < reference["transitions_held"][after]).all()
    assert metrics["fitness_best"][after].tolist() == reference["fitness_best"][after].tolist()


def size(run):
    latest = max((run / "checkpoints").iterdir(), key=lambda path: int(path.name))
    return sum(path.stat().st_size for path in latest.rglob("*") if path.is_file())


def wait_for(condition, process, seconds=300.0):
    end = time.monotonic() + seconds
    while not condition():
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < end
        time.sleep(0.005)


def kill_after(process, seconds):
    print(f"SIGKILL after {seconds:.3f} s")  # Shown if the test fails.
    time.sleep(seconds)
    process.kill()
    process.communicate()
