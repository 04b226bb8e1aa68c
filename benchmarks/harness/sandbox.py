"""A folder that a command may write in, and a watch on whatever touches anything beside it."""

import contextlib
import os
import sys
import tempfile
from collections.abc import Generator
from pathlib import Path
from typing import Any

CANARY = "skillcrew_canary"
"""A module that nobody may import: run folders name it."""

WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
CHANGES = {"os.mkdir": 1, "os.remove": 1, "os.rmdir": 1, "os.rename": 2, "os.truncate": 1, "os.symlink": 2}
"""Events of Python's audit, and how many paths they begin with."""


class Watch:
    """Notes what leaves a folder while it is on: files written, programs started, the canary imported."""

    def __init__(self, folder: Path):
        self._folder = os.path.realpath(folder)
        # What catches the output of a command lies there.
        self._scratch = tempfile.gettempdir()
        # JAX puts compiled programs there, where whoever runs us asks for that; no command line can.
        self._compiled = os.path.realpath(os.environ.get("JAX_COMPILATION_CACHE_DIR") or folder)
        self._on = False
        self.noted: list[str] = []
        sys.addaudithook(self._hear)

    @contextlib.contextmanager
    def on(self) -> Generator[None]:
        self.noted.clear()
        self._on = True
        try:
            yield
        finally:
            self._on = False

    def _hear(self, event: str, arguments: tuple[Any, ...]) -> None:
        if not self._on:
            return
        if event == "open":
            path, _, flags = arguments
            named = isinstance(path, str | bytes) and flags & WRITING
            # The system refuses to follow a link where it is asked to.
            if named and not (flags & os.O_NOFOLLOW and os.path.islink(path)):
                self._check(event, path)
        elif event in CHANGES:
            for path in arguments[: CHANGES[event]]:
                # Relative to an open folder, whose own removal was heard.
                if isinstance(path, str | bytes) and arguments[-1] in (-1, None):
                    self._check(event, path)
        elif event == "shutil.rmtree":
            self._check(event, arguments[0])
        elif event in ("subprocess.Popen", "os.system", "os.exec", "os.posix_spawn"):
            self.noted.append(f"{event} {arguments[0]!r}")
        elif event == "import" and arguments[0].partition(".")[0] == CANARY:
            self.noted.append(f"import of {arguments[0]}")

    def _check(self, event: str, path: str | bytes) -> None:
        self._on = False
        try:
            text = os.fsdecode(path)
            whole = os.path.join(os.path.realpath(os.path.dirname(text) or "."), os.path.basename(text))
            if event == "open":
                whole = os.path.realpath(text)
            # No folder can be made there.
            if event == "os.mkdir" and whole.startswith("/proc/"):
                return
            scratch = os.path.dirname(whole) == self._scratch or whole == self._scratch
            free = tuple(place + os.sep for place in (self._folder, self._compiled, "/dev"))
            if not (whole.startswith(free) or scratch):
                self.noted.append(f"{event} {text}")
        except (OSError, ValueError):
            pass
        finally:
            self._on = True
