"""Gathers the site's pages, from all over the repository, in `build/pages`; `make docs` then builds them.

Pages stay what they are in the repository; here their links are made to lead to where things are on the site.
What a browser would not show becomes a page: a folder lists its files, a text shows itself.
"""

import os
import re
import shutil
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
OUT = ROOT / "build/pages"
PAGES = (
    "README.md",
    "CONTRIBUTING.md",
    "CHANGELOG.md",
    "docs/**/*.md",
    "results/**/*.md",
    "benchmarks/**/*.md",
)
PARTS = [ROOT / "docs/site/style.css", ROOT / "docs/site/worker.js"]
TEXTS = {".py": "python", ".pyi": "python", ".yaml": "yaml", ".json": "json", ".csv": "text", ".txt": "text"}
"""Files that are shown on a page of their own, and the language of each."""

LINK = re.compile(r"(\]\()([^)\s#:]*)(#[^)\s]*)?(?=\))")
CODE = re.compile(r"^( *```+).*?^\1`*$|`[^`\n]+`", re.DOTALL | re.MULTILINE)
NAMES = re.compile(r"^Names: (?:`[\w.]+`,?\s)+", re.MULTILINE)
"""Whose docstrings the site shows in their place."""


def gather():
    """Writes all pages, and all files that they link to."""
    shutil.rmtree(OUT, ignore_errors=True)
    waiting, known = [*PARTS, *pages()], set()
    while waiting:
        path = waiting.pop()
        if path in known:
            continue
        known.add(path)
        place = OUT / address(path)
        place.parent.mkdir(parents=True, exist_ok=True)
        if path.suffix == ".md":
            place.write_text(_for_the_site(path))
            waiting += [to for to, _ in links(path) if to.exists()]
        elif path.is_dir() or path.suffix in TEXTS:
            place.write_text(_shown(path))
            waiting += [other for other in _inside(path) if other.suffix not in TEXTS]
        else:
            shutil.copyfile(path, place)


def pages():
    """Every page, as a path in the repository."""
    return sorted(path for pattern in PAGES for path in ROOT.glob(pattern))


def dead_links():
    """What leads nowhere, as lines."""
    dead = []
    for page in pages():
        for to, anchor in links(page):
            if not (to.exists() and to.is_relative_to(ROOT)):
                dead.append(f"{page.relative_to(ROOT)}: there is no {os.path.relpath(to, ROOT)}")
            elif anchor and to.suffix == ".md" and anchor not in anchors(to):
                dead.append(f"{page.relative_to(ROOT)}: {to.relative_to(ROOT)} has no #{anchor}")
    return dead


def links(page):
    """The paths in the repository that a page links to, each with what follows its #."""
    found = LINK.finditer(CODE.sub("", page.read_text()))
    return [(_target(page, match[2]), (match[3] or "")[1:]) for match in found]


def anchors(page):
    """What can follow # behind a page's name; where two headings are alike, of the first alone."""
    headings = re.findall(
        r"^#+ (.*)$",
        CODE.sub(lambda match: match[0].strip("`") if "\n" not in match[0] else "", page.read_text()),
        re.MULTILINE,
    )
    return {re.sub(r"[^\w -]", "", heading).strip().lower().replace(" ", "-") for heading in headings}


def address(path):
    """Where a file, or the page that shows it, is on the site: `docs/` is its root."""
    name = path.relative_to(ROOT).as_posix()
    if path.is_dir():
        name += "/README.md"
    elif path.suffix in TEXTS:
        name += ".md"
    name = {"README.md": "overview.md"}.get(name, name).removeprefix("docs/")
    return re.sub(r"(^|/)README\.md$", r"\1index.md", name)


def _target(page, link):
    to = (page.parent / link).resolve() if link else page
    return to / "README.md" if (to / "README.md").is_file() else to


def _for_the_site(page):
    def mended(match):
        to = _target(page, match[2])
        if not match[2] or not to.exists():
            return match[0]
        return match[1] + os.path.relpath(address(to), Path(address(page)).parent) + (match[3] or "")

    text = _wider(LINK.sub(mended, page.read_text()))
    return NAMES.sub(lambda match: "\n\n".join(f"::: {name}" for name in names(match[0])) + "\n", text)


def _wider(text):
    """What belongs to a numbered item, by four spaces: GitHub asks for three."""
    lines, numbered = [], False
    for line in text.split("\n"):
        if line and line[0] != " ":
            numbered = bool(re.match(r"\d+\. ", line))
        lines.append(f" {line}" if numbered and line.startswith("   ") else line)
    return "\n".join(lines)


def names(text):
    """The public names that a page of the reference lists."""
    return [name for row in NAMES.findall(text) for name in re.findall(r"`([\w.]+)`", row)]


def _inside(folder):
    hidden = (".", "__")
    return (
        sorted(path for path in folder.iterdir() if not path.name.startswith(hidden))
        if folder.is_dir()
        else []
    )


def _shown(path):
    """The page of a folder or of a text."""
    parts = [f"# {path.name}", f"`{path.relative_to(ROOT)}` in the repository."]
    if not path.is_dir():
        return "\n\n".join([*parts, _code(path)])
    for other in _inside(path):
        if other.suffix in TEXTS:
            parts.append(f'??? abstract "{other.name}"\n\n    ' + _code(other).replace("\n", "\n    "))
        elif other.suffix == ".png":
            parts.append(f"![{other.stem}]({other.name})")
        else:
            parts.append(f"[{other.name}]({os.path.relpath(address(other), Path(address(path)).parent)})")
    return "\n\n".join(parts)


def _code(path):
    return f"````{TEXTS[path.suffix]}\n{path.read_text().rstrip()}\n````"


if __name__ == "__main__":
    if dead := dead_links():
        sys.exit("\n".join(dead))
    gather()
