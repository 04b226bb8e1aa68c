"""Pages lead to one another, on GitHub and on the site, and say what there is."""

import importlib.util
import os
import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def load(name):
    spec = importlib.util.spec_from_file_location(name, ROOT / "docs" / "site" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def pages():
    return load("pages")


def in_navigation(part):
    """Every page that the navigation leads to."""
    if isinstance(part, str):
        return [part]
    return [
        page for inner in (part.values() if isinstance(part, dict) else part) for page in in_navigation(inner)
    ]


def test_no_link_is_dead(pages):
    assert pages.dead_links() == []


def test_dead_links_are_noticed(pages, tmp_path, monkeypatch):
    monkeypatch.setattr(pages, "ROOT", tmp_path)
    (tmp_path / "docs").mkdir()
    (tmp_path / "docs" / "one.md").write_text(
        "# The `one`, and\n[a](two.md) [b](two.md#in-short) [c](#the-one-and)"
    )
    (tmp_path / "README.md").write_text("[a](docs/one.md#the-two)\n```\n[b](three.md)\n```\n`[c](four.md)`")
    assert pages.dead_links() == [
        "README.md: docs/one.md has no #the-two",
        *["docs/one.md: there is no docs/two.md"] * 2,
    ]


def test_the_site_has_every_page_and_all_they_show(pages, tmp_path, monkeypatch):
    monkeypatch.setattr(pages, "OUT", tmp_path)
    pages.gather()
    navigation = in_navigation(tomllib.loads((ROOT / "zensical.toml").read_text())["project"]["nav"])
    assert len(navigation) == len(set(navigation))
    assert {page for page in navigation if not (tmp_path / page).is_file()} == set()
    documents = {pages.address(page) for page in pages.pages() if page.is_relative_to(ROOT / "docs")}
    assert documents - set(navigation) == set()
    for page in tmp_path.rglob("*.md"):
        text = pages.CODE.sub("", page.read_text())
        for _, link, _ in pages.LINK.findall(text):
            assert not link or (page.parent / link).is_file(), f"{page.relative_to(tmp_path)}: {link}"


def test_what_belongs_to_a_numbered_item_stays_there(pages):
    text = "1. One:\n   - a\n\n       code\n2. Two\n\n```\n   kept\n```\n- x\n   y"
    assert pages._wider(text) == "1. One:\n    - a\n\n        code\n2. Two\n\n```\n   kept\n```\n- x\n   y"


def test_folders_and_texts_become_pages(pages, tmp_path, monkeypatch):
    monkeypatch.setattr(pages, "ROOT", tmp_path)
    monkeypatch.setattr(pages, "OUT", tmp_path / "out")
    monkeypatch.setattr(pages, "PARTS", [])
    (tmp_path / "runs" / "more").mkdir(parents=True)
    (tmp_path / "runs" / "config.yaml").write_text("steps: 5\n")
    (tmp_path / "runs" / "curve.png").write_bytes(b"picture")
    (tmp_path / "README.md").write_text("[runs](runs) and [one](runs/config.yaml)")
    pages.gather()
    assert (
        tmp_path / "out" / "overview.md"
    ).read_text() == "[runs](runs/index.md) and [one](runs/config.yaml.md)"
    listing = (tmp_path / "out" / "runs" / "index.md").read_text()
    assert (
        "    steps: 5" in listing and "![curve](curve.png)" in listing and "[more](more/index.md)" in listing
    )
    assert (tmp_path / "out" / "runs" / "curve.png").read_bytes() == b"picture"
    assert (tmp_path / "out" / "runs" / "more" / "index.md").is_file()
    assert "steps: 5" in (tmp_path / "out" / "runs" / "config.yaml.md").read_text()


def test_the_reference_has_every_public_name(pages):
    public = re.findall(r"(\w+) as \1\b", (ROOT / "src" / "skillcrew" / "__init__.pyi").read_text())
    texts = "".join(page.read_text() for page in (ROOT / "docs" / "reference").glob("*.md"))
    named = pages.names(texts)
    assert len(named) == len(set(named))
    assert {f"skillcrew.{name}" for name in public} - set(named) == set()


def test_pictures_are_those_of_their_script():
    drawings = load("drawings")
    assert (drawings.IMAGES / "four-choices.svg").read_text() == drawings.four_choices()
    assert (drawings.IMAGES / "which-reward.svg").read_text() == drawings.which_reward()


def test_a_site_that_loads_from_elsewhere_is_refused(tmp_path, monkeypatch):
    offline = load("offline")
    monkeypatch.setattr(offline, "SITE", tmp_path)
    (tmp_path / "site").mkdir()
    (tmp_path / "site" / "worker.js").touch()
    (tmp_path / "a").mkdir()
    page = tmp_path / "a" / "page.html"
    shim = '<script src="https://far.example/iframe-worker/shim" type="text/javascript"></script>'
    page.write_text(f'<p>{shim}<a href="https://docs.jax.dev">JAX</a><img src="near.png">')
    offline.main()
    assert f'src="{os.path.join("..", "site", "worker.js")}"' in page.read_text()
    page.write_text('<script async src="https://far.example/a.js"></script><link href=//far.example/b.css>')
    (tmp_path / "a.css").write_text("@import url(https://far.example/c.css)")
    with pytest.raises(SystemExit) as end:
        offline.main()
    assert [f"far.example/{name}" in end.value.code for name in ("a.js", "b.css", "c.css")] == [True] * 3
