"""The studio in a real browser: curves grow, runs appear and vanish, nothing complains."""

import shutil

import pytest

from analysis.page import meadow
from analysis.studio.folders import EVIL, grow, write_run
from browser import chromium, find_chromium
from skillcrew.analysis.page.assemble import assemble
from skillcrew.analysis.page.contents import describe
from skillcrew.experiment.ownership import owned

pytestmark = pytest.mark.skipif(find_chromium() is None, reason="there is no Chromium to open it with")

NAMES = "[...document.querySelectorAll('#rows b')].map((name) => name.textContent).join()"
LABELS = "[...document.querySelectorAll('.entry')].map((entry) => entry.dataset.label).join()"
LENGTH = "document.querySelector('.mean')?.getAttribute('d').split('L').pop()"


def state_of(name):
    rows = "[...document.querySelectorAll('#rows tr')]"
    one = f"{rows}.find((row) => row.querySelector('b').textContent === {name!r})"
    return f"{one}?.querySelector('.state').textContent"


def test_it_shows_what_happens_while_it_happens(studio, root, tmp_path_factory):
    run = write_run(root / "run", 0.25)
    report = write_run(root / EVIL, 1.0, environment=EVIL) / "report"
    report.mkdir()
    described = describe([meadow.contents()], [], EVIL)
    (report / "report.html").write_text(assemble(described, EVIL) + "<script>alert(1)</script>")
    with chromium(tmp_path_factory.mktemp("chromium")) as tab, owned(run):
        tab.size(1200, 900)
        tab.open(studio.url)
        tab.wait_for(f"{NAMES} === 'run,{EVIL}' && {LABELS} === 'run'")
        assert tab.run(state_of("run")) == "training"
        before = tab.run(LENGTH)
        grow(run, 0.75)
        tab.wait_for(f"{LENGTH} !== {before!r}")
        write_run(root / "late", 0.5)
        tab.wait_for(f"{NAMES} === 'run,late,{EVIL}'")
        tab.run("[...document.querySelectorAll('#rows input')].forEach((tick) => tick.click())")
        tab.wait_for(f"{LABELS} === 'late,{EVIL}'")
        shutil.rmtree(root / "late")
        (run / "metrics.parquet").write_bytes(b"half")
        tab.wait_for(f"{NAMES} === '{EVIL},run' && {state_of('run')} === 'damaged'")
        tab.wait_for(f"{LABELS} === {EVIL!r}")
        assert tab.run("document.images.length") == 0
        assert tab.run("document.documentElement.scrollWidth <= innerWidth")
        page = tab.run("document.querySelector('#rows a').href")
        tab.open(page)
        assert tab.run("title.textContent") == EVIL and tab.run("origin") == "null"
        assert not tab.complaints
        assert {address.split("?")[0].removeprefix(studio.url) for address in tab.requests} == {
            "",
            "runs",
            "curves",
            "page",
        }
