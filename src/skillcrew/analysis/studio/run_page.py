"""The page of one run: the one that its report wrote, put together anew, or one that is made on demand."""

import dataclasses
import json
import os
import re
import shutil
import subprocess
import sys
import threading
from pathlib import Path

from skillcrew.analysis.page.assemble import assemble
from skillcrew.analysis.report import PAGE
from skillcrew.analysis.studio.remembered import Remembered, Stamp, stamp
from skillcrew.analysis.studio.survey import check_own
from skillcrew.errors import UserError, one_line
from skillcrew.experiment.files import read_plain
from skillcrew.experiment.folder import RunFolder

LARGEST_PAGE = 2**25
"""Bytes."""

MOST_PAGES = 20
"""Made ones that are kept until the studio ends."""

DATA = re.compile(r'<script type="application/json" id="data">(.*?)</script>', re.DOTALL)

COMMAND = (sys.executable, "-P", "-c", "from skillcrew.cli.main import main; main()", "report")


@dataclasses.dataclass(frozen=True)
class Shown:
    """What a browser is shown of a run."""

    page: str | None = None
    line: str = ""
    """Instead of a page."""
    waits: bool = False
    """Whether the page will be there soon."""


class Pages:
    """Pages of runs.

    Args:
        root: out of which no link is followed.
        scratch: an existing folder for pages that are made on demand; nothing is written into run folders.
    """

    def __init__(self, root: Path, scratch: Path):
        self._root, self._scratch = root, scratch
        self._made = Remembered(MOST_PAGES)
        self._busy: tuple[Path, Stamp] | None = None
        self._process: subprocess.Popen[str] | None = None
        self._lock = threading.Lock()

    def show(self, path: Path) -> Shown:
        """The page of a run, or how it comes; makes one page at a time.

        Raises:
            UserError: what is written is no page, or there is no champion to make one of.
        """
        folder = RunFolder(path)
        written = folder.report / PAGE
        check_own(written, self._root, LARGEST_PAGE)
        if written.is_file():
            return Shown(put_together(written))
        check_own(folder.config, self._root, LARGEST_PAGE)
        if folder.checkpoints.is_symlink() or not folder.checkpoints.is_dir():
            return Shown(line="It has no champion yet: the first checkpoint is still to come.")
        return self._made_of(folder)

    def close(self) -> None:
        """Ends what is under way."""
        with self._lock:
            if self._process is not None:
                self._process.kill()

    def _made_of(self, folder: RunFolder) -> Shown:
        state = stamp((folder.config, folder.metrics))
        with self._lock:
            if self._made.has(folder.path, state):
                return self._made.get(folder.path, state, Shown)
            if self._busy is None:
                self._busy = (folder.path, state)
                threading.Thread(target=self._make, args=(folder, state), daemon=True).start()
        if self._busy is not None and self._busy[0] != folder.path:
            return Shown(line="The page of another run is being made; this one comes next.", waits=True)
        line = "Its page is being made: the champions play, which takes a minute or so."
        return Shown(line=line, waits=True)

    def _make(self, folder: RunFolder, state: Stamp) -> None:
        out = self._scratch / "page"
        try:
            shown = self._report(folder, out)
        except Exception as error:
            shown = Shown(line=one_line(f"{folder.path}: {error}"))
        finally:
            shutil.rmtree(out, ignore_errors=True)
        with self._lock:
            self._made.put(folder.path, state, shown)
            self._busy, self._process = None, None

    def _report(self, folder: RunFolder, out: Path) -> Shown:
        """What `skillcrew report` makes, in a process of its own, which leaves no memory behind."""
        # A graphics card is left to those who train on it; and no Ctrl-C that is meant for the studio.
        process = subprocess.Popen(
            [*COMMAND, str(folder.path.absolute()), "--out", str(out)],
            env={**os.environ, "JAX_PLATFORMS": "cpu"},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            errors="replace",
            start_new_session=True,
        )
        with self._lock:
            self._process = process
        _, said = process.communicate()
        if process.returncode == 0:
            return Shown(put_together(out / PAGE))
        return Shown(line=one_line((said.strip().splitlines() or ["its page could not be made"])[-1]))


def put_together(written: Path) -> str:
    """A page of the data in a written one, by the scripts of this skillcrew; nothing else of it is taken.

    Raises:
        UserError: there is no such data in it.
    """
    try:
        found = DATA.search(read_plain(written))
        contents = json.loads(found[1]) if found else None
        if not (isinstance(contents, dict) and {"title", "panels", "runs"} <= contents.keys()):
            raise ValueError
        return assemble(contents, str(contents["title"]))
    except (OSError, ValueError, RecursionError):
        raise UserError(
            f"{written}: not a page that skillcrew wrote; `skillcrew report` writes it anew"
        ) from None
