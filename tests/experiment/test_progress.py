"""What people see: few lines in a log, a table in a terminal, and the right numbers in both."""

import io

import numpy as np
import pytest
from rich.console import Console

from skillcrew.experiment import progress
from skillcrew.experiment.progress import (
    LineReporter,
    LiveReporter,
    SkillsDone,
    Summary,
    clock,
    human,
    make_reporter,
    tracked,
)
from skillcrew.intervals import seed_interval

BUDGET = 10_000


def chunk(steps):
    """Two seeds, two generations; the second seed is the slower one."""
    return {
        "generation": np.asarray([[3, 4], [3, 4]]),
        "environment_steps": np.asarray([[steps, steps + 1000], [steps - 500, steps]]),
        "success_rate": np.asarray([[0.2, 0.4], [0.6, 0.8]]),
        "fitness_best": np.asarray([[0.0, 0.5], [0.0, 0.7]]),
        "fitness_mean": np.asarray([[0.0, 0.1], [0.0, 0.3]]),
        "return_go_to_poi_A": np.asarray([[1.0, 2.0], [3.0, 4.0]]),
        "stopped_at_go_to_poi_A": np.asarray([[-1, -1], [-1, 4]]),
    }


def console(terminal):
    return Console(force_terminal=terminal, file=io.StringIO(), width=120)


def test_the_numbers_of_a_summary():
    summary = Summary(chunk(4000), BUDGET, steps_per_second=200.0)
    assert summary.generation == 4
    assert summary.steps == 4000, "the slowest seed decides how far the run is"
    assert summary.score_by_seed.tolist() == pytest.approx([0.3, 0.7])
    assert (summary.best, summary.mean) == pytest.approx((0.6, 0.2))
    assert summary.returns == {"go_to_poi_A": 2.5}
    assert summary.stopped == {"go_to_poi_A": 1}
    # Both seeds step on until the slower one has lived its 6000 more: 12000 steps at 200 a second.
    assert summary.seconds_left == 60
    interval = seed_interval(np.asarray([0.3, 0.7]))
    assert summary.champion() == f"0.50 [{interval.low:.2f}, {interval.high:.2f}]"


def test_a_summary_beyond_the_budget_and_before_any_pace():
    done = Summary(chunk(12_000), BUDGET, 100.0)
    assert (done.steps, done.seconds_left) == (BUDGET, 0)
    assert Summary(chunk(4000), BUDGET, 0.0).seconds_left == np.inf


def test_who_is_at_the_budget_before_the_others_is_shown_as_scored():
    """Not as what it becomes while it waits for the slowest seed."""
    early, late = chunk(4000), chunk(9000)
    # The first seed is past its 10,000 steps when the second chunk begins.
    late["environment_steps"] = np.asarray([[11_000, 14_000], [7_000, 9_000]])
    out = console(False)
    arrived = progress.Arrived(BUDGET)
    arrived.standing(early)
    shown = arrived.standing({**late, "success_rate": np.asarray([[0.9, 1.0], [0.5, 0.5]])})
    assert shown["success_rate"].tolist() == [[0.4, 0.4], [0.5, 0.5]]
    assert shown["environment_steps"].tolist() == late["environment_steps"].tolist()
    reporter = LineReporter(out, BUDGET)
    reporter.update(early, 100.0)
    reporter._last = -np.inf
    reporter.update({**late, "success_rate": np.asarray([[0.9, 1.0], [0.5, 0.5]])}, 100.0)
    assert "9 k of 10 k steps, success 0.45 [" in out.file.getvalue()


def test_a_return_is_called_one_and_has_its_own_scale():
    metrics = chunk(4000)
    metrics["team_return"] = 1000.0 * metrics.pop("success_rate") - 700.0
    summary = Summary(metrics, BUDGET, 200.0)
    interval = seed_interval(np.asarray([-400.0, 0.0]), -np.inf, np.inf)
    assert interval.low < -400 and interval.high > 0
    assert summary.champion() == f"-200 [{interval.low:.4g}, {interval.high:.4g}]"
    line, table = console(False), console(True)
    LineReporter(line, BUDGET).update(metrics, 200.0)
    assert "steps, return -200 [" in line.file.getvalue() and "success" not in line.file.getvalue()
    live = LiveReporter(table, BUDGET, (0, 1))
    live.update(metrics, 200.0)
    live.close()
    assert "champion's team return" in table.file.getvalue() and "0: -400" in table.file.getvalue()


def test_one_seed_has_no_interval():
    alone = {name: values[:1] for name, values in chunk(4000).items()}
    assert Summary(alone, BUDGET, 100.0).champion() == "0.30"


def test_logs_get_a_line_now_and_then(monkeypatch):
    out = console(False)
    reporter = make_reporter(BUDGET, (0, 1), out)
    assert isinstance(reporter, LineReporter)
    now = 0.0
    monkeypatch.setattr(progress.time, "monotonic", lambda: now)
    reporter.note("Compiled in [1.0] s.")
    reporter.note("\udcff\x1b is gone")
    for step in range(500):
        now = 0.1 * step
        reporter.update(chunk(1000 + step), 200.0)
    reporter.update(chunk(BUDGET), 200.0)
    reporter.close()
    lines = out.file.getvalue().splitlines()
    assert lines[0] == "Compiled in [1.0] s.", "brackets are no markup"
    assert lines.pop(1) == r"\udcff\x1b is gone", "a name of a file in bytes that are no text"
    assert 4 <= len(lines) - 1 <= 7, "every ten seconds and at the end"
    assert lines[1].startswith("1 k of 10 k steps, success 0.50 [") and "go_to_poi_A=2.50" in lines[1]
    assert "fitness best 0.60 mean 0.20" in lines[1] and lines[1].endswith("1:30 left")
    assert "1 of 2 skills done, 200 steps/s" in lines[1]
    assert lines[-1].startswith("10 k of 10 k steps") and lines[-1].endswith("0:00 left")
    assert "\x1b" not in out.file.getvalue()


def test_without_skills_nothing_is_said_of_their_returns():
    out = console(False)
    of_skills = ("return_", "stopped_at_")
    metrics = {name: values for name, values in chunk(BUDGET).items() if not name.startswith(of_skills)}
    LineReporter(out, BUDGET).update(metrics, 200.0)
    (line,) = out.file.getvalue().splitlines()
    assert "return" not in line and "mean 0.20, 200 steps/s" in line


def test_when_skills_stopped_is_remembered():
    skills = SkillsDone()
    now = chunk(4000)
    del now["stopped_at_go_to_poi_A"]
    assert skills.said_after(now) == "", "an algorithm without skills"

    def said(*by_skill):
        stopped = {f"stopped_at_{k}": np.asarray([at] * 2).T for k, at in enumerate(by_skill)}
        return skills.said_after({**now, **stopped})

    assert said((-1, -1), (-1, -1)) == ""
    assert said((3, -1), (-1, -1)) == "1 of 4 skills done"
    assert said((3, -1), (3, -1)) == "2 of 4 skills done"
    now["generation"] = now["generation"] + 2
    now["environment_steps"] = now["environment_steps"] + 2000
    assert said((3, 5), (3, 6)) == "skills done at 6 k", "the slowest seed's last skill"
    now["generation"] = now["generation"] + 2
    assert said((3, 5), (3, 6)) == "skills done at 6 k"
    skills = SkillsDone()
    assert said((3, 5), (3, 6)) == "skills done", "it stopped before this process began"


def test_terminals_get_a_table():
    out = console(True)
    reporter = make_reporter(BUDGET, (2000, 2001), out)
    assert isinstance(reporter, LiveReporter)
    reporter.note("Compiled in 1.0 s.")
    reporter.update(chunk(4000), 200.0)
    reporter.close()
    reporter.close()  # The command closes it once more on its way out.
    text = out.file.getvalue()
    for part in ("Compiled in 1.0 s.", "4 k of 10 k steps", "200 steps/s", "1:00 left", "40%"):
        assert part in text
    assert "1 of 2 skills done" in text
    for part in ("2000: 0.30", "2001: 0.70", "0.50", "return of go_to_poi_A", "stopped in 1 of 2 seeds"):
        assert part in text


def test_a_quiet_run_says_nothing(capsys):
    reporter = make_reporter(BUDGET, (0, 1), quiet=True)
    reporter.note("a line")
    reporter.update(chunk(4000), 100.0)
    reporter.close()
    captured = capsys.readouterr()
    assert captured.out == captured.err == ""


def test_progress_goes_to_standard_error(capsys):
    reporter = make_reporter(BUDGET, (0, 1))
    reporter.note("a line")
    reporter.close()
    captured = capsys.readouterr()
    assert captured.out == "" and "a line" in captured.err


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        *[(0, "0:00"), (5.4, "0:05"), (59.6, "1:00"), (61, "1:01"), (3599.7, "1:00:00"), (3661, "1:01:01")],
        *[(100 * 3600, "100:00:00"), (float("inf"), "unknown time"), (float("nan"), "unknown time")],
    ],
)
def test_time_left(seconds, text):
    assert clock(seconds) == text


@pytest.mark.parametrize(
    ("number", "text"),
    [(0, "0"), (999, "999"), (1000, "1 k"), (1500, "1.5 k"), (4e6, "4 M"), (123_456, "123 k")],
)
def test_counts(number, text):
    assert human(number) == text


@pytest.mark.parametrize("number", [999.7, 999_600, 999_999, 2_000_000_000])
def test_counts_never_turn_into_powers_of_ten(number):
    assert "e" not in human(number)


@pytest.mark.parametrize(
    ("terminal", "quiet", "shown"), [(True, False, True), (True, True, False), (False,) * 3]
)
def test_a_bar_where_somebody_looks(terminal, quiet, shown):
    where = console(terminal)
    assert list(tracked(iter("abc"), 3, "drawing", quiet, where)) == ["a", "b", "c"]
    assert ("drawing" in where.file.getvalue()) == shown
