"""Files that are read are files, and of a size that fits."""

import pytest

from skillcrew.experiment import files
from skillcrew.experiment.files import read_plain


def test_a_file_of_text_is_read_and_one_that_is_too_large_is_not(tmp_path, monkeypatch):
    path = tmp_path / "about.json"
    path.write_text("é" * 100)
    assert read_plain(path) == "é" * 100
    monkeypatch.setattr(files, "LARGEST_TEXT", 199)
    with pytest.raises(OSError, match="too large"):
        read_plain(path)


def test_devices_and_folders_have_no_text(tmp_path):
    (tmp_path / "zero").symlink_to("/dev/zero")
    for path in (tmp_path / "zero", tmp_path):
        with pytest.raises(OSError, match="no file"):
            read_plain(path)
