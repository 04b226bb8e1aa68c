"""Programs that are measured side by side, each in a process and an interpreter of its own."""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parent.parent


class Process:
    """One side. It works only while `ask` waits for it.

    Args:
        command: a program that calls `serve`.
    """

    def __init__(self, name: str, command: list[str]):
        self.name = name
        self._log = tempfile.TemporaryFile("w+")  # noqa: SIM115  It lives as long as the process.
        self._process = subprocess.Popen(
            command,
            cwd=ROOT,
            env={**os.environ, "PYTHONUNBUFFERED": "1"},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._log,
            text=True,
            bufsize=1,
        )
        self.ready = self._reply()
        """What it said of itself when it was ready."""

    def ask(self, **command: Any) -> dict[str, Any]:
        """Its answer to one command."""
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps(command) + "\n")
        return self._reply()

    def close(self) -> None:
        """Ends the process."""
        self._process.communicate()

    def _reply(self) -> dict[str, Any]:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            self._log.seek(0)
            raise SystemExit(f"{self.name} stopped:\n{self._log.read()[-2000:]}")
        return json.loads(line)


Started = tuple[dict[str, Any], Callable[[dict[str, Any]], dict[str, Any]]]
"""What a side says of itself, and what answers a command."""


def serve(start: Callable[[], Started]) -> None:
    """Answers commands from standard input, one line of JSON each, until there are no more.

    Libraries print as they please; what they print goes to standard error, so that standard output
    has nothing but answers.

    Args:
        start: makes the side ready.
    """
    answers = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(2, 1)
    ready, answer = start()
    answers.write(json.dumps(ready) + "\n")
    for line in sys.stdin:
        answers.write(json.dumps(answer(json.loads(line))) + "\n")


def say(line: str) -> None:
    """Progress, which is no part of what is printed as a result."""
    print(line, file=sys.stderr, flush=True)
