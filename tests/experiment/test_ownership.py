"""Two processes never train in one folder."""

import errno
import fcntl
import os
import signal
import socket
import subprocess
import sys

import pytest

import skillcrew as sc
from experiment.tiny import Countdown, Counting, InterruptAfter, contents
from skillcrew.experiment.ownership import holder, owned

HOLDS = """
import sys, time
from pathlib import Path
from skillcrew.experiment.ownership import owned
with owned(Path(sys.argv[1])):
    print("holds", flush=True)
    time.sleep(600)
"""


def test_the_second_is_refused_in_one_line_that_names_the_first(tmp_path):
    with owned(tmp_path):
        said = f"process {os.getpid()} on {socket.gethostname()}"
        with pytest.raises(sc.UserError, match=said) as caught, owned(tmp_path):
            pass
        assert "\n" not in str(caught.value)
    with owned(tmp_path):
        pass


def test_what_is_left_of_an_owner_is_empty(tmp_path):
    with owned(tmp_path):
        assert (tmp_path / "owner.lock").read_text()
    assert contents(tmp_path) == {"owner.lock": b""}


def test_it_is_free_once_its_process_is_killed(tmp_path):
    process = subprocess.Popen(
        [sys.executable, "-c", HOLDS, str(tmp_path)], stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "holds\n"
    with pytest.raises(sc.UserError, match=f"process {process.pid} on"), owned(tmp_path):
        pass
    process.send_signal(signal.SIGKILL)
    process.communicate()
    with owned(tmp_path):
        pass


def test_a_file_system_without_locks_refuses_nobody(tmp_path, monkeypatch):
    def no_locks(*_):
        raise OSError(errno.ENOLCK, "no locks available")

    monkeypatch.setattr(fcntl, "flock", no_locks)
    with owned(tmp_path), owned(tmp_path):
        pass


def test_while_a_run_trains_it_is_read_by_anybody_and_trained_by_nobody_else(counting, tmp_path):
    seen: list[str] = []

    def look():
        sc.Run(tmp_path / "run", Countdown())
        with pytest.raises(sc.UserError, match="trains in it") as caught:
            resumed.resume()
        seen.append(str(caught.value))

    options = {"checkpoint_seconds": 0.0, "generations_per_report": 2, "score_episodes": 3}
    sc.train(Counting(Countdown()), 1, 20, tmp_path / "run", **options)
    resumed = sc.Run(tmp_path / "run", Countdown())
    sc.Run(tmp_path / "run", Countdown()).resume(60, InterruptAfter(1, look))
    assert len(seen) == 1


def test_what_a_link_in_its_place_leads_to_is_not_emptied(tmp_path):
    letter = tmp_path / "letter.txt"
    letter.write_text("Dear reader")
    run = tmp_path / "run"
    run.mkdir()
    (run / "owner.lock").symlink_to(letter)
    with pytest.raises(sc.UserError, match=r"owner\.lock: cannot be written"), owned(run):
        pass
    assert letter.read_text() == "Dear reader"


def test_a_pipe_in_its_place_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "owner.lock")
    with pytest.raises(sc.UserError, match=r"owner\.lock: cannot be written"), owned(tmp_path):
        pass


def test_who_holds_a_run_is_known_without_holding_it(tmp_path):
    assert holder(tmp_path) is None
    with owned(tmp_path):
        assert f"process {os.getpid()} on" in str(holder(tmp_path))
    assert holder(tmp_path) is None
    (tmp_path / "owner.lock").write_text("process 1 on elsewhere, which was killed")
    assert holder(tmp_path) is None
    with owned(tmp_path):
        pass


def test_what_stands_in_the_place_of_a_lock_is_not_read(tmp_path):
    (tmp_path / "letter.txt").write_text("Dear reader")
    (tmp_path / "owner.lock").symlink_to(tmp_path / "letter.txt")
    assert holder(tmp_path) is None
    (tmp_path / "owner.lock").unlink()
    os.mkfifo(tmp_path / "owner.lock")
    assert holder(tmp_path) is None


def test_nobody_who_trains_is_kept_out_by_those_who_look(tmp_path, monkeypatch):
    tried = []
    with owned(tmp_path):
        pass
    monkeypatch.setattr(fcntl, "flock", lambda *_: tried.append(1))
    holder(tmp_path)
    assert not tried
