"""The `skillcrew` command: finds the subcommand, and turns a user's mistake into one line."""

import contextlib
import importlib
import importlib.metadata
import io
import os
import sys
import warnings
from collections.abc import Generator
from typing import Any

from skillcrew.errors import LESS_MEMORY, Notice, UserError, one_line, out_of_memory, unknown_name

COMMANDS = {
    "train": "train an algorithm in an environment, then write a report",
    "resume": "go on with a run after an interruption, or beyond its budget",
    "evaluate": "score a run's champions on fresh episodes",
    "report": "write a page of one or more runs, with replays, and figures",
    "render": "make a film or a picture of one of a champion's episodes",
    "studio": "look at a folder of runs in the browser, live",
    "export": "write a champion into a folder from which it acts without skillcrew",
    "show": "how far a run is, what it reached, and every option of it",
    "check": "say what is wrong with an environment of your own, and what is fine",
    "compare": "train several algorithms in one environment: one figure, one table",
    "reproduce": "train and compare what the MADyS thesis compares, in its six configurations",
    "list": "algorithms, environments, skills and their options",
    "completion": "a script that completes these words in bash, zsh or fish",
}

NO_MEMORY = f"the machine has no memory left, and what a run has saved is kept; {LESS_MEMORY}"
USER_MISTAKE = 2
INTERRUPTED = 130


def main() -> None:
    """Entry point; exits 0 when done, 2 on a user's mistake, 130 if interrupted after saving."""
    if isinstance(sys.stdout, io.TextIOWrapper):
        # What a terminal has no letters for is no reason to end; standard error is so from the start.
        sys.stdout.reconfigure(errors="backslashreplace")
    sys.exit(run_command(sys.argv[1:]))


def run_command(words: list[str]) -> int:
    """Runs one command line and returns its exit code."""
    if not words or words[0] in ("-h", "--help"):
        print(usage())
        return 0 if words else USER_MISTAKE
    if words == ["--version"]:
        print(f"skillcrew {importlib.metadata.version('skillcrew')}")
        return 0
    try:
        _check_text(words)
        if words[0] not in COMMANDS:
            raise unknown_name("command", words[0], COMMANDS)
        with _notices_as_lines():
            return importlib.import_module(f"skillcrew.cli.{words[0]}").run(words[1:])
    except UserError as error:
        print(f"skillcrew: {error}", file=sys.stderr)
        return USER_MISTAKE
    except KeyboardInterrupt:
        print("skillcrew: interrupted", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:
        # The reader of our output, such as `head`, has gone; nothing is left to say to it.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except Exception as error:
        if not out_of_memory(error):
            raise
        print(f"skillcrew: {NO_MEMORY}", file=sys.stderr)
        return USER_MISTAKE


def _check_text(words: list[str]) -> None:
    """Refuses names of files in bytes that are no text: no other file could name them."""
    for word in words:
        try:
            word.encode()
        except UnicodeEncodeError:
            raise UserError(f"'{word}': not written in UTF-8; rename it") from None


@contextlib.contextmanager
def _notices_as_lines() -> Generator[None]:
    """Prints notices as lines of ours, and leaves all other warnings as they are."""
    with warnings.catch_warnings():
        shown = warnings.showwarning

        def show(message: Warning | str, category: type[Warning], *place: Any, **options: Any) -> None:
            if issubclass(category, Notice):
                print(f"skillcrew: {one_line(str(message))}", file=sys.stderr)
            else:
                shown(message, category, *place, **options)

        warnings.showwarning = show  # ty: ignore[invalid-assignment]
        warnings.simplefilter("always", Notice)
        yield


def usage() -> str:
    """What `skillcrew --help` prints."""
    lines = [
        "usage: skillcrew COMMAND [--help] ...",
        "       skillcrew --version",
        "",
        "Teams of agents that learn to coordinate.",
        "",
    ]
    lines += [f"  {name:<10} {about}" for name, about in COMMANDS.items()]
    lines += [
        "",
        "For example:",
        "  skillcrew train madys rover-t2-c1 --seeds 5 --steps 2e6",
        "  skillcrew evaluate runs/madys-rover-t2-c1 --episodes 1000",
    ]
    return "\n".join(lines)
