"""The page in a real browser: it draws, plays and switches, complains of nothing and asks nobody."""

import re

import pytest

from analysis.page import meadow
from browser import chromium, find_chromium
from skillcrew.analysis.page.contents import Pooled
from skillcrew.analysis.page.write import write_page

pytestmark = pytest.mark.skipif(find_chromium() is None, reason="there is no Chromium to open the page with")

ALL_DRAWN = """
(id) => {
  const canvas = document.getElementById(id);
  const pixels = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
  return new Set(new Uint32Array(pixels.buffer)).size;
}
"""


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    one, other = meadow.contents(), meadow.contents(meadow.Bare)
    pooled = [Pooled((0, 1), one.curves)]
    return write_page(
        [one, other], pooled, f"title {meadow.EVIL}", tmp_path_factory.mktemp("page") / "a.html"
    )


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    with chromium(tmp_path_factory.mktemp("chromium")) as tab:
        yield tab


@pytest.fixture
def tab(browser, path):
    browser.complaints.clear()
    browser.requests.clear()
    browser.size(1200, 900)
    browser.prefers("light")
    assert browser.open(path) < 30  # A machine that does much else; alone it takes a tenth of a second.
    yield browser
    assert not browser.complaints
    assert browser.requests == [path.resolve().as_uri()]


def text(tab, name):
    return tab.run(f"document.getElementById('{name}').textContent")


def value(tab, name):
    return tab.run(f"document.getElementById('{name}').value")


def choose(tab, name, index):
    tab.run(f"(s => {{ s.selectedIndex = {index}; s.dispatchEvent(new Event('change')) }})({name})")


def middle_of(tab, selector):
    box = f"document.querySelector('{selector}').getBoundingClientRect()"
    tab.run(f"document.querySelector('{selector}').scrollIntoView({{block: 'center', behavior: 'instant'}})")
    return tab.run(f"(b => [b.x + b.width / 2, b.y + b.height / 2])({box})")


def test_all_is_there_and_names_are_text(tab):
    assert meadow.EVIL in text(tab, "title") and tab.run("document.images.length") == 0
    assert tab.run("document.querySelectorAll('.mean').length") == 2
    assert tab.run("document.querySelectorAll('.seed').length") == 4
    assert tab.run("document.querySelectorAll('.band').length") == 2
    for canvas in ("picture", "timeline"):
        assert tab.run(f"({ALL_DRAWN})('{canvas}')") > 6, canvas
    assert tab.run("document.querySelectorAll('#shares canvas').length") == 2
    assert "all seeds" in text(tab, "scores") and f"command {meadow.EVIL}" in text(tab, "about-files")
    assert tab.run("document.documentElement.scrollWidth <= innerWidth")


def test_it_plays_to_the_end_and_stops(tab):
    tab.run("document.getElementById('speed').value = '50'")
    tab.key(" ")
    tab.wait_for("!document.getElementById('play').classList.contains('moving') && Number(scrub.value) > 0")
    assert value(tab, "scrub") == tab.run("scrub.max")
    steps = tab.run("scrub.max")
    assert text(tab, "time") == f"step {steps} of {steps}" and "solved in" in text(tab, "outcome")


def test_keys_step_and_choose(tab):
    tab.key("ArrowRight")
    assert value(tab, "scrub") == "1"
    tab.key("ArrowLeft")
    tab.key("End")
    assert value(tab, "scrub") == tab.run("scrub.max")
    before = value(tab, "episode")
    tab.key("n")
    assert value(tab, "episode") != before and value(tab, "scrub") == "0"
    tab.key("p")
    assert value(tab, "episode") == before
    tab.key("2")
    assert text(tab, "sensors-title") == "Sensors of agent 2"
    assert tab.run("document.querySelectorAll('.reading').length") == 3


def test_the_picture_changes_with_the_time_line(tab):
    tab.run("[...document.querySelectorAll('#jumps button')].at(-1).click()")
    assert "failed, 6 steps" in text(tab, "outcome")
    before = tab.run("picture.toDataURL()")
    x, y = middle_of(tab, "#timeline")
    tab.click(x, y)
    assert 0 < int(value(tab, "scrub")) < int(tab.run("scrub.max"))
    assert tab.run("picture.toDataURL()") != before
    assert re.match(r"Step \d, agent \d: go ", text(tab, "timeline-said"))


def test_what_the_pointer_is_at_is_said(tab):
    x, y = middle_of(tab, "#agents button")
    tab.mouse("mouseMoved", x, y)
    assert text(tab, "sensors-title") == "Sensors of agent 1"
    x, y = middle_of(tab, ".chart")
    tab.mouse("mouseMoved", x, y)
    assert tab.run("document.querySelectorAll('.cross').length") == 2, "panels are not linked"
    x, y = middle_of(tab, "#shares canvas")
    tab.mouse("mouseMoved", x, y)
    assert "of the episodes still run" in text(tab, "shares-said")


def test_seeds_and_runs_are_switched(tab):
    before = text(tab, "episode")
    tab.key("s")
    tab.wait_for("document.documentElement.dataset.shown === '0/1'")
    assert text(tab, "episode") != before and value(tab, "seed") == "11"
    choose(tab, "run", 1)
    tab.wait_for("document.documentElement.dataset.shown === '1/0'")
    assert tab.run("document.getElementById('picture-box').hidden") and "no scene" in text(tab, "played")
    assert tab.run(f"({ALL_DRAWN})('timeline')") > 3
    assert [word for word in ("Best", "Worst") if word in text(tab, "jumps")] == ["Best", "Worst"]


def test_curves_are_switched(tab):
    linear = tab.run("document.querySelector('.mean').getAttribute('d')")
    for name in ("logarithmic", "single-seeds", "pool"):
        tab.run(f"document.getElementById('{name}').click()")
    assert tab.run("document.querySelector('.mean').getAttribute('d')") != linear
    assert not tab.run("document.querySelectorAll('.seed').length")
    assert "2 runs" in tab.run("document.querySelector('.entry').textContent")
    tab.run("document.querySelector('.entry').click()")
    assert tab.run("document.querySelectorAll('.mean').length") == 1


def test_both_grounds_and_narrow_screens(tab):
    ground = "getComputedStyle(document.body).backgroundColor"
    light, drawn = tab.run(ground), tab.run("picture.toDataURL()")
    tab.key("t")
    assert tab.run(ground) != light and tab.run("picture.toDataURL()") != drawn
    tab.prefers("dark")
    tab.size(360, 700)
    tab.wait_for("picture.getBoundingClientRect().right < 360")
    assert tab.run("document.documentElement.scrollWidth <= innerWidth")
