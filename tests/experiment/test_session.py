"""A run can be asked to stop at any generation, and then ends as if nobody had."""

import numpy as np
import pytest

import skillcrew as sc
from experiment.tiny import Countdown, InterruptAfter, assert_same_arrays
from skillcrew.experiment import session
from skillcrew.experiment.checkpoints import Checkpoints
from skillcrew.experiment.config import RunConfig
from skillcrew.experiment.generation import shapes
from skillcrew.experiment.metrics import read_metrics

OPTIONS = {"score_episodes": 3, "generations_per_report": 4, "checkpoint_seconds": 1e9, "keep": 1}


class Clock:
    """A clock that is set by hand."""

    def __init__(self):
        self.now = 0.0

    def monotonic(self):
        return self.now


@pytest.fixture
def clock(monkeypatch):
    clock = Clock()
    monkeypatch.setattr(session, "time", clock)
    return clock


def test_a_call_lives_as_many_generations_as_somebody_who_waits_has_patience_for(clock):
    running = session.Session(0)
    assert running.generations(left=5) == 1, "nobody knows yet how long one takes"
    for seconds_each, expected in ((0.01, 5), (0.5, 4), (0.7, 2), (9.0, 1), (0.0, 5)):
        asked = running.generations(left=5)
        clock.now += seconds_each * asked
        running.lived(asked)
        assert running.generations(left=5) == expected
    assert running.generations(left=2) == 2


def test_its_time_is_up_after_so_many_seconds(clock):
    clock.now = 100.0
    limited, free = session.Session(0, 30.0), session.Session(0)
    clock.now = 129.0
    assert not limited.is_over()
    clock.now = 130.0
    assert limited.is_over() and not free.is_over()
    assert limited.rate(60) == pytest.approx(2.0)


def test_speed_is_told_as_it_was_of_late(clock):
    running = session.Session(1000)
    told = []
    # 10 steps a second for two minutes, then 40.
    for clock.now, steps in ((20, 1200), (60, 1600), (120, 2200), (140, 3000), (180, 4600), (200, 5400)):
        told.append(running.recent_rate(steps))
    assert told[:3] == [10, 10, 10]
    assert told[3:] == [pytest.approx((3000 - 1600) / 80), pytest.approx(40), pytest.approx(40)]
    assert running.rate(5400) == 22, "of all its time"
    assert running.recent_rate(3000) == 0, "it rolled back"


def test_it_is_the_speed_of_late_that_is_reported(counting, tmp_path, monkeypatch):
    monkeypatch.setattr(session.Session, "recent_rate", lambda self, steps: 123.0)
    reporter, told = InterruptAfter(10**9, None), []
    reporter.update = lambda metrics, rate: told.append(rate)  # ty: ignore
    sc.train(counting, 1, 20, tmp_path / "run", reporter=reporter, **OPTIONS)
    assert set(told) == {123.0}


def test_rows_are_written_for_those_who_watch_and_take_a_hundredth_of_the_time(clock):
    running = session.Session(0)
    clock.now = session.WATCHED_SECONDS - 0.1
    assert not running.rows_are_due()
    clock.now = session.WATCHED_SECONDS
    assert running.rows_are_due()
    with running.writing_rows():
        clock.now += 0.5
    clock.now += 49.0
    assert not running.rows_are_due()
    clock.now += 1.0
    assert running.rows_are_due()
    running.saved()
    assert not running.rows_are_due()


def test_rows_of_a_run_that_trains_are_there_before_its_checkpoint(counting, tmp_path, monkeypatch):
    monkeypatch.setattr(session, "WATCHED_SECONDS", 0.0)
    monkeypatch.setattr(session, "WATCHED_SHARE", 1e9)
    seen = []
    look = InterruptAfter(3, lambda: seen.append(read_metrics(tmp_path / "run" / "metrics.parquet")))
    sc.train(counting, 1, 200, tmp_path / "run", reporter=look, **OPTIONS)
    assert seen[0]["generation"].tolist() == [*range(1, 9)], "of the two reports before"


def arrays(run):
    like = shapes(run.algorithm, run.config)
    return {
        name: np.asarray(array) for name, array in Checkpoints(run.folder.checkpoints).read(like)[0].items()
    }


def test_a_run_that_is_stopped_after_every_generation_ends_as_one_that_never_was(counting, tmp_path):
    sc.train(counting, (3, 4), 50, tmp_path / "whole", **OPTIONS)
    with pytest.raises(sc.Interrupted):
        sc.train(counting, (3, 4), 50, tmp_path / "run", max_seconds=1e-9, **OPTIONS)
    ends = []
    for _ in range(20):
        run = sc.Run(tmp_path / "run", Countdown())
        ends.append(int(run.metrics()["generation"].max()))
        try:
            run.resume()
        except sc.Interrupted:
            continue
        break
    assert ends == [1, 2, 3, 4, 5, 6, 7], "one generation a session, and the last one ends with a report"
    whole = sc.Run(tmp_path / "whole", Countdown())
    assert read_metrics(whole.folder.metrics)["generation"].max() == 8
    assert_same_arrays(run.metrics(), whole.metrics())
    assert_same_arrays(arrays(run), arrays(whole))


def test_reports_come_when_they_would_have_come_after_one_was_cut_short(counting, tmp_path):
    with pytest.raises(sc.Interrupted):
        sc.train(counting, 1, 200, tmp_path / "run", max_seconds=1e-9, **OPTIONS)
    reported = InterruptAfter(10**9, None)
    seen: list[list[int]] = []
    reported.update = lambda metrics, _: seen.append(metrics["generation"][0].tolist())  # ty: ignore
    sc.Run(tmp_path / "run", Countdown()).resume(max_seconds=1e9, reporter=reported)
    assert seen[:2] == [[2, 3, 4], [5, 6, 7, 8]]


@pytest.mark.parametrize(
    ("field", "value", "said"),
    [
        ("max_seconds", 0.0, "positive"),
        ("warning_signal", "USR9", "USR1"),
        ("warning_signal", "KILL", "USR1"),
    ],
)
def test_values_that_make_no_sense(field, value, said):
    with pytest.raises(sc.UserError, match=said) as caught:
        RunConfig(**{field: value})
    assert "\n" not in str(caught.value)
