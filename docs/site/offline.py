"""Makes the built site complete without a network, and refuses one that loads anything from elsewhere."""

import os
import re
import sys
from pathlib import Path

SITE = Path(__file__).parents[2] / "build/site"
SHIM = re.compile(r'<script src="[^"]*/iframe-worker/shim"[^>]*></script>')
"""What the generator puts into pages that are read from files, for the worker that searches."""
OURS = "site/worker.js"
LOADS = re.compile(
    r"<(?:script|link|img|iframe|source)\b[^>]*?\b(?:src|href)=[\"']?((?:https?:)?//[^\"'\s>]+)"
)
STYLED = re.compile(r"(?:url\(|@import )[\"']?((?:https?:)?//[^\"')\s]+)")


def main():
    """Ours in the place of what comes from elsewhere; ends with a line for each thing that is left."""
    left = []
    for page in SITE.rglob("*.html"):
        ours = f'<script src="{os.path.relpath(SITE / OURS, page.parent)}"></script>'
        mended = SHIM.sub(ours, page.read_text())
        page.write_text(mended)
        left += [f"{page.relative_to(SITE)} loads {address}" for address in LOADS.findall(mended)]
    for sheet in SITE.rglob("*.css"):
        left += [
            f"{sheet.relative_to(SITE)} loads {address}" for address in STYLED.findall(sheet.read_text())
        ]
    if not (SITE / OURS).is_file():
        left.append(f"there is no {OURS}")
    if left:
        sys.exit("\n".join(left))


if __name__ == "__main__":
    main()
