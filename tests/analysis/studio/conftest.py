"""A studio of an empty folder."""

import pytest

from analysis.studio.asking import listening


@pytest.fixture
def root(tmp_path):
    (tmp_path / "runs").mkdir()
    return tmp_path / "runs"


@pytest.fixture
def studio(root, tmp_path_factory):
    with listening(root, tmp_path_factory.mktemp("scratch")) as client:
        yield client
