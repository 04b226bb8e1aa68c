import shutil

import pytest

from experiment import tiny


@pytest.fixture
def finished():
    """The folder of a finished run. Read only: all tests share it."""
    return tiny.finished_run()


@pytest.fixture
def copied(finished, tmp_path):
    """A copy of a finished run, to damage."""
    return shutil.copytree(finished, tmp_path / "run")
