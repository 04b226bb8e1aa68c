"""Processes side by side: how many, on which cores, and how they end. Stubs stand for command lines."""

import os
import signal
import subprocess
import sys
import time

import psutil
import pytest

from skillcrew.cli import jobs
from skillcrew.cli.jobs import Job, available_cores, run_jobs
from skillcrew.errors import UserError

# A job that says when it began and ended, and on which cores it was told to be. It takes some seconds,
# or as long as there is no file of a name.
WORKER = """
import os, sys, time
cores, until, code = sys.argv[1:]
print("begin", time.monotonic(), cores, flush=True)
if until.startswith("/"):
    while not os.path.exists(until):
        time.sleep(0.01)
else:
    time.sleep(float(until))
print("end", time.monotonic(), flush=True)
sys.exit(int(code))
"""

# A job that saves when it is told to end, as `skillcrew train` does.
SAVER = """
import os, signal, sys, time
def end(*_):
    print("told", flush=True)
    time.sleep(0.3)
    print("saved", flush=True)
    told.append(1)
told = []
signal.signal(signal.SIGTERM, end)
signal.signal(signal.SIGINT, lambda *_: print("Ctrl-C", flush=True))
print("began, session of its own:", os.getsid(0) == os.getpid(), flush=True)
while not told:
    time.sleep(0.01)
time.sleep(0.2)
sys.exit(130)
"""

# The process of a real job, but for the command: it says what it got, works for some seconds and fails.
COMMAND = (
    """
import os, sys, time
import skillcrew.cli.main as main
def run_command(words):
    print(os.getpid(), bound, words, flush=True)
    time.sleep(float(words[0]))
    return 7
main.run_command = run_command
bound = []
os.sched_setaffinity = lambda process, cores: bound.append((process, sorted(cores)))
"""
    + jobs.START
)

PARENT = """
import sys
from pathlib import Path
from skillcrew.cli import jobs
jobs.START = sys.argv[2]
jobs.run_jobs([jobs.Job("long", ("100",), Path(sys.argv[1]))], 1, lambda *_: None)
"""


@pytest.fixture
def stub(monkeypatch, tmp_path):
    """Makes jobs that run a program of ours, and looks at them often."""
    monkeypatch.setattr(jobs, "POLL_SECONDS", 0.01)

    def make(program, *words):
        monkeypatch.setattr(jobs, "START", program)
        return [
            Job(f"job {index}", tuple(map(str, each)), tmp_path / f"{index}.log")
            for index, each in enumerate(words)
        ]

    return make


def times(job):
    """When a job began and ended."""
    begin, end = job.log.read_text().splitlines()
    return float(begin.split()[1]), float(end.split()[1])


def ignore(running, ended):
    del running, ended


@pytest.mark.parametrize("at_once", [1, 2, 3])
def test_jobs_run_in_their_order_and_so_many_at_once(at_once, stub):
    made = stub(WORKER, *[(0.15, 0)] * 5)
    seen, over = [], []

    def watch(running, ended):
        assert all(job.log.exists() for job in running)
        seen.append(len(running))
        over.extend(ended)

    assert run_jobs(made, at_once, watch) == ([], False)
    assert sorted(job.name for job in over) == [job.name for job in made], "each ends once"
    spans = [times(job) for job in made]
    assert max(sum(begin <= now < end for begin, end in spans) for now, _ in spans) <= at_once
    assert max(seen) == at_once, "fewer ran side by side than might have"
    for index, (begin, _) in enumerate(spans[at_once:], start=at_once):
        # It waited for so many of those before it to end.
        assert sum(end <= begin for _, end in spans[:index]) >= index - at_once + 1


def test_nothing_to_do():
    assert run_jobs([], 2, ignore) == ([], False)


def test_those_that_fail_are_returned_and_the_others_still_run(stub):
    made = stub(WORKER, (0, 0), (0, 3), (0, 0), (0, "no number"), (0, 0))
    failed, interrupted = run_jobs(made, 2, ignore)
    assert (failed, interrupted) == ([made[1], made[3]], False)
    assert [job.last_line().split()[0] for job in made] == ["end", "end", "end", "ValueError:", "end"]


def test_a_log_keeps_what_was_said_before(stub):
    (job,) = stub(WORKER, (0, 0))
    job.log.write_text("said before\n")
    run_jobs([job], 1, ignore)
    assert [line.split()[0] for line in job.log.read_text().splitlines()] == ["said", "begin", "end"]


def test_the_last_line_is_the_last_that_says_anything(tmp_path):
    log = tmp_path / "log"
    job = Job("one", (), log)
    assert job.last_line() == ""
    log.write_bytes(b"first\nsecond \xff\n \n\n")
    assert job.last_line() == "second \ufffd"
    log.write_text("\n")
    assert job.last_line() == ""


def test_a_log_that_cannot_be_written_is_one_line(stub, tmp_path):
    (job,) = stub(WORKER, (0, 0))
    job = Job("one", job.words, tmp_path / "missing" / "log")
    with pytest.raises(UserError, match=r"missing/log: cannot be written"):
        run_jobs([job], 1, ignore)


def test_jobs_side_by_side_have_cores_of_their_own(stub, monkeypatch, tmp_path):
    monkeypatch.setattr(jobs, "available_cores", lambda: [2, 5, 7])
    # The first lasts until the third has begun, which takes the place of the second.
    made = stub(WORKER, (tmp_path / "2.log", 0), (0, 0), (0, 0))
    run_jobs(made, 2, ignore)
    assert [job.log.read_text().split()[2] for job in made] == ["2,7", "5", "5"]


@pytest.mark.parametrize(
    ("cores", "count", "shares"),
    [
        ([0, 1, 2, 3, 4], 2, [(0, 2, 4), (1, 3)]),
        ([0, 1, 2], 3, [(0,), (1,), (2,)]),
        ([4, 6], 5, [(4,), (6,), (4,), (6,), (4,)]),
        ([3], 1, [(3,)]),
    ],
)
def test_cores_are_dealt_out_evenly(cores, count, shares, monkeypatch):
    monkeypatch.setattr(jobs, "available_cores", lambda: cores)
    assert jobs._shares(count) == shares


def test_available_cores_are_those_that_the_process_may_use(monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda process: {9, 3} if process == 0 else {1})
    assert available_cores() == [3, 9]
    monkeypatch.delattr(os, "sched_getaffinity")
    monkeypatch.setattr(os, "cpu_count", lambda: 3)
    assert available_cores() == [0, 1, 2]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_is_passed_on_once_and_waited_for(number, stub):
    before = signal.getsignal(number)
    made = stub(SAVER, (), (), ())
    sent = []

    def watch(running, ended):
        if not sent and all(job.last_line().startswith("began") for job in running):
            sent.append(len(running))
            os.kill(os.getpid(), number)

    assert run_jobs(made, 2, watch) == ([], True)
    assert sent == [2]
    for job in made[:2]:
        lines = job.log.read_text().splitlines()
        # Ctrl-C in a terminal reaches the session of the parent: that of the jobs is another one.
        assert lines == ["began, session of its own: True", "told", "saved"]
    assert not made[2].log.exists(), "a job began after the interrupt"
    assert signal.getsignal(number) is before


def wait_for(condition, what, seconds=60.0):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, what
        time.sleep(0.02)


def is_alive(pid):
    # Orphans that have ended may stay zombies where nobody collects them.
    try:
        return psutil.Process(pid).status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


def test_jobs_end_with_their_parent_even_if_that_is_killed(tmp_path):
    log = tmp_path / "log"
    parent = subprocess.Popen([sys.executable, "-c", PARENT, str(log), COMMAND])
    child = None
    try:
        wait_for(lambda: log.exists() and log.read_text().endswith("\n"), "it never began")
        child = int(log.read_text().split()[0])
        assert child != parent.pid and parent.poll() is None
        time.sleep(0.3)
        assert is_alive(child)
        parent.send_signal(signal.SIGKILL)
        parent.wait()
        wait_for(lambda: not is_alive(child), "it lives on without its parent", 20)
    finally:
        parent.kill()
        parent.wait()
        if child is not None and is_alive(child):
            os.kill(child, signal.SIGKILL)


def test_a_real_job_runs_the_command_on_its_cores(stub, monkeypatch):
    monkeypatch.setattr(jobs, "available_cores", lambda: [3, 8])
    (job,) = stub(COMMAND, (0, "a word", "--out=x"))
    assert run_jobs([job], 1, ignore) == ([job], False)
    _, said = job.log.read_text().split(" ", 1)
    assert said == "[(0, [3, 8])] ['0', 'a word', '--out=x']\n"
