"""ERL on Pendulum-v1: ours beside EvoRL's, return and time after as many environment steps.

    python -m benchmarks.evorl --evorl-python VENV/bin/python --evorl-source CHECKOUT

Each side runs in a process and an interpreter of its own, both pinned to the same core and strictly
one at a time; seeds alternate between the sides, and so does who goes first. Before anything is measured, our
pendulum replays episodes of theirs, and must give the same observations, rewards and ends.
"""

import argparse
import dataclasses
import json
import statistics
import sys
from pathlib import Path
from typing import Any

from benchmarks import evorl_page
from benchmarks.evorl_race import Settings
from benchmarks.talking import Process, say

HERE = Path(__file__).parent
OPTIONS = ("budget", "population", "episodes", "updates_per_episode", "learning_rate")
"""Settings that the command line can change."""
TOLERANCE = 1e-4
"""Largest difference between the two pendulums that is put down to rounding."""


def start(settings: Settings, python: Path, source: Path) -> list[Process]:
    """Ours, then theirs, each compiled while the other does nothing."""
    common = json.dumps(dataclasses.asdict(settings))
    commands = {
        "skillcrew": [sys.executable, "-m", "benchmarks.evorl_ours", common],
        # Resolving it would leave its virtual environment for the Python that that was made from.
        "EvoRL": [str(python.absolute()), "-m", "benchmarks.evorl_theirs", common, str(source.resolve())],
    }
    processes = []
    for name, command in commands.items():
        say(f"{name}: compiling ...")
        processes.append(Process(name, command))
    return processes


def check_parity(ours: Process, theirs: Process) -> dict[str, Any]:
    """How far the two pendulums are apart.

    Raises:
        SystemExit: further than rounding explains.
    """
    difference = ours.ask(do="parity", record=theirs.ask(do="parity"))
    if max(difference["observation"], difference["reward"]) > TOLERANCE or difference["ends"]:
        raise SystemExit(f"the two pendulums differ: {difference}")
    return difference


def measure(processes: list[Process], seeds: range) -> dict[str, list[dict[str, Any]]]:
    """Every seed on both sides."""
    runs: dict[str, list[dict[str, Any]]] = {process.name: [] for process in processes}
    for seed in seeds:
        for process in processes if seed % 2 == 0 else processes[::-1]:
            run = process.ask(do="run", seed=seed)
            runs[process.name].append(run)
            last = run["curve"][-1]
            say(
                f"seed {seed}, {process.name}: {run['wall']:.0f} s, {run['processor']:.0f} s of the core, "
                f"population {last['population']:.0f}, learner {last['learner']:.0f}, "
                f"mean of the learner's curve {statistics.mean(row['learner'] for row in run['curve']):.0f}"
            )
    return runs


def parse() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--evorl-python", type=Path, required=True, help="the interpreter that has its needs")
    parser.add_argument("--evorl-source", type=Path, required=True, help="a checkout of EMI-Group/evorl")
    parser.add_argument("--seeds", type=int, default=5, help="seeds of each side (default 5)")
    for name in OPTIONS:
        default = getattr(Settings, name)
        option = "--" + name.replace("_", "-")
        parser.add_argument(option, type=type(default), default=default, help=f"default {default}")
    parser.add_argument("--out", type=Path, default=HERE / "results" / "evorl.md", help="the page to write")
    return parser.parse_args()


def main() -> None:
    """Measures, prints and writes the page."""
    arguments = parse()
    settings = Settings(**{name: getattr(arguments, name) for name in OPTIONS})
    processes = start(settings, arguments.evorl_python, arguments.evorl_source)
    try:
        parity = check_parity(*processes)
        say(f"parity: {parity}")
        runs = measure(processes, range(arguments.seeds))
    finally:
        for process in processes:
            process.close()
    ready = {process.name: process.ready for process in processes}
    page = evorl_page.page(settings, ready, runs, parity)
    print(page)
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    arguments.out.write_text(page)


if __name__ == "__main__":
    main()
