"""Figures are written whole, and alike each time."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from matplotlib.figure import Figure

from skillcrew.analysis.canvas import save
from skillcrew.errors import UserError


def made_up_figure():
    figure = Figure()
    figure.subplots().plot([1, 2, 5], [0.2, 0.4, 0.3])
    return figure


def test_saved_files_are_a_png_and_a_pdf_of_the_same_bytes_every_time(tmp_path):
    written = []
    for folder in ("one", "two"):
        stem = tmp_path / folder / "fig-4.2"
        written.append(save(made_up_figure(), stem))
        assert [path.name for path in written[-1]] == ["fig-4.2.png", "fig-4.2.pdf"]
        assert sorted(path.name for path in stem.parent.iterdir()) == ["fig-4.2.pdf", "fig-4.2.png"]
    png, pdf = (path.read_bytes() for path in written[0])
    assert png.startswith(b"\x89PNG") and pdf.startswith(b"%PDF") and pdf.rstrip().endswith(b"%%EOF")
    assert b"Date" not in pdf and b"atplotlib" not in png
    assert (png, pdf) == tuple(path.read_bytes() for path in written[1])
    # Pixels per metre, as PNG counts them, of 150 dots per inch.
    assert int.from_bytes(png[png.index(b"pHYs") + 4 :][:4], "big") == round(150 / 0.0254)


def test_a_failed_save_leaves_the_old_file_and_nothing_else(tmp_path, monkeypatch):
    figure = made_up_figure()
    png, pdf = save(figure, tmp_path / "curves")
    old = png.read_bytes()

    write = Path.write_bytes

    def full_disk(path, drawn):
        assert path.parent == tmp_path and path not in (png, pdf) and drawn == old
        write(path, b"half a fi")
        raise OSError(28, "No space left on device")

    # Matplotlib, which on a full disk fails in ways of its own, draws in memory.
    with monkeypatch.context() as disk:
        disk.setattr(Path, "write_bytes", full_disk)
        with pytest.raises(UserError, match=r"curves\.png: cannot be written, the disk is full"):
            save(figure, tmp_path / "curves")
    assert png.read_bytes() == old
    assert sorted(os.listdir(tmp_path)) == ["curves.pdf", "curves.png"]


def test_a_folder_that_cannot_be_is_the_users_to_mend(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(UserError, match=r"figure\.png: cannot be written"):
        save(Figure(), tmp_path / "file" / "figure")


def test_pyplot_is_never_loaded():
    code = "import sys, skillcrew.analysis.report; sys.exit('matplotlib.pyplot' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
