"""One HTML file of a page's parts, which asks nobody for anything and lets no text become script."""

import base64
import dataclasses
import hashlib
import html
import json
import re
from importlib import resources
from typing import Any

POLICY = "default-src 'none'; script-src '{script}'; style-src '{style}'; base-uri 'none'; form-action 'none'"
"""Nothing is loaded, and nothing runs but the one script and the one style sheet that have these digests."""


@dataclasses.dataclass(frozen=True)
class Template:
    """The files that a page is put together from."""

    page: str
    styles: tuple[str, ...]
    scripts: tuple[str, ...] = ()
    """In the order in which they stand in the page, each of what it needs behind it."""
    loads: str = ""
    """Directives of the policy that let it load something."""


RUNS = Template(
    "page.html",
    ("look.css", "parts.css"),
    (
        "unpack.js",
        "text.js",
        "theme.js",
        "chart.js",
        "curves.js",
        "shares.js",
        "episodes.js",
        "marks.js",
        "picture.js",
        "timeline.js",
        "replay.js",
        "page.js",
    ),
)
"""The page of runs."""


def assemble(contents: Any, title: str, template: Template = RUNS) -> str:
    """The whole page.

    Args:
        contents: what `describe` made; any text in it is data, whatever it holds.
    """
    style = "\n".join(asset(name) for name in template.styles)
    script = "\n".join(asset(name) for name in template.scripts)
    parts = {
        "POLICY": POLICY.format(script=_digest(script), style=_digest(style)) + template.loads,
        "TITLE": html.escape(title),
        "STYLE": style,
        "SCRIPT": script,
        "DATA": as_data(contents),
    }
    # At one go: what is put in is not looked through for places.
    return re.sub(r"\{\{([A-Z]+)\}\}", lambda place: parts[place[1]], asset(template.page))


def as_data(contents: Any) -> str:
    """JSON in which no browser finds the end of a script, a comment, or a line."""
    text = json.dumps(contents, allow_nan=False, separators=(",", ":"))
    # U+2028 and U+2029 are escaped with all else that is not ASCII.
    return text.replace("&", "\\u0026").replace("<", "\\u003c").replace(">", "\\u003e")


def asset(name: str) -> str:
    """The text of one of the page's own files."""
    return resources.files("skillcrew.analysis.page").joinpath("assets", name).read_text(encoding="utf-8")


def _digest(text: str) -> str:
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode("ascii")
