import shutil

import pytest

from experiment import tiny
from skillcrew.algorithms import registry


@pytest.fixture
def finished():
    """The folder of a finished run. Read only: all tests share it."""
    return tiny.finished_run()


@pytest.fixture
def copied(finished, tmp_path):
    """A copy of a finished run, to damage."""
    return shutil.copytree(finished, tmp_path / "run")


@pytest.fixture
def counting(monkeypatch):
    """The counting algorithm, known by name as those of skillcrew are."""
    tiny.compile_once()
    monkeypatch.setitem(registry.ALGORITHMS, "counting", tiny.Counting)
    return tiny.Counting(tiny.Countdown())
