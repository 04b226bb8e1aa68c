"""MADDPG on two of the particle worlds: ours beside BenchMARL's, return and time after as many steps.

    python -m benchmarks.benchmarl --python VENV/bin/python

Each side runs in a process and an interpreter of its own, both pinned to the same core and strictly one at
a time; seeds alternate between the sides. Theirs lives in PettingZoo's worlds and ours in JaxMARL's: before
anything is measured, ours lives recorded episodes of theirs again, and must see and be paid the same.
"""

import argparse
import statistics
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from benchmarks.benchmarl_settings import EPISODE, TASKS, Settings
from benchmarks.machine import cpu_model, software
from benchmarks.talking import Process, say

from skillcrew.intervals import seed_interval

PAGE = Path(__file__).parent / "results" / "benchmarl.md"
TOLERANCE = 1e-4
"""Largest difference between the two worlds that is put down to rounding."""
METHODS = {"BenchMARL's MADDPG": "theirs", "our MADDPG": "maddpg", "our MATD3": "matd3"}
HEAD = """# MADDPG beside BenchMARL's

{machine}; {software}. One core, one thread.

Continuous actions, {steps:,} environment steps, seeds 0 to {last}; networks of 64 and 64 units, one actor and
one critic for each agent, {updates} updates of {batch:,} rows after every {lived} steps, step size {rate:g},
discount {discount:g}. Returns are means over agents and {scored} fresh episodes without noise. Seconds are
one seed's on the processor, without compiling.
"""


def check_parity(ours: Process, theirs: Process) -> float:
    """How far the two worlds are apart.

    Raises:
        SystemExit: further than rounding explains.
    """
    apart = max(ours.ask(do="parity", **theirs.ask(do="parity")).values())
    if apart > TOLERANCE:
        raise SystemExit(f"the two worlds differ by {apart:g}")
    return apart


def measure(sides: Mapping[str, Process], seeds: int) -> dict[str, list[dict[str, Any]]]:
    """Every seed by every method."""
    runs: dict[str, list[dict[str, Any]]] = {title: [] for title in METHODS}
    for seed in range(seeds):
        for title, name in METHODS.items():
            run = sides["theirs" if name == "theirs" else "ours"].ask(do="run", algorithm=name, seed=seed)
            runs[title].append(run)
            say(f"seed {seed}, {title}: return {run['return']:.2f}, {run['seconds']:.0f} s")
    return runs


def row(title: str, runs: list[dict[str, Any]], steps: int, peer: float) -> str:
    """A line of a table; `peer` is how many steps per second the peer lived."""
    returns = np.array([run["return"] for run in runs])
    over_seeds = seed_interval(returns, -np.inf, np.inf)
    rate = steps / statistics.mean(run["seconds"] for run in runs)
    each = " ".join(f"{value:.2f}" for value in returns)
    interval = f"{over_seeds.mean:.2f} [{over_seeds.low:.2f}, {over_seeds.high:.2f}]"
    return f"| {title} | {each} | {interval} | {steps / rate:.0f} | {rate:,.0f} | {rate / peer:.1f} |"


def section(settings: Settings, python: Path, seeds: int) -> tuple[list[str], dict[str, str]]:
    """Lines about one world, and the versions that they were measured with."""
    text = settings.to_json()
    sides = {
        "ours": Process("skillcrew", [sys.executable, "-m", "benchmarks.benchmarl_ours", text]),
        # Resolving it would leave its virtual environment for the Python that that was made from.
        "theirs": Process("BenchMARL", [str(python.absolute()), "-m", "benchmarks.benchmarl_theirs", text]),
    }
    try:
        apart = check_parity(sides["ours"], sides["theirs"])
        say(f"{settings.task}: the two worlds differ by {apart:.1g} at most")
        runs = measure(sides, seeds)
    finally:
        for side in sides.values():
            side.close()
    peer = settings.steps / statistics.mean(run["seconds"] for run in runs["BenchMARL's MADDPG"])
    lines = [
        f"\n## `{settings.task}`\n",
        f"Random actions return {sides['theirs'].ready['random']:.2f}. Over recorded episodes the two worlds "
        f"differ by {apart:.1g} at most. Both of ours compile in {sides['ours'].ready['compiling']:.0f} s.\n",
        "| method | return, each seed | mean [95 %] | seconds | steps per second | times BenchMARL's |",
        "|---|---|---|---|---|---|",
        *(row(title, found, settings.steps, peer) for title, found in runs.items()),
    ]
    return lines, {**sides["ours"].ready["versions"], **sides["theirs"].ready["versions"]}


def main() -> None:
    """Measures, prints and writes the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--python", type=Path, required=True, help="the interpreter that has BenchMARL")
    parser.add_argument("--seeds", type=int, default=5, help="seeds of each method (default 5)")
    parser.add_argument("--steps", type=float, default=2e5, help="environment steps of each (default 2e5)")
    parser.add_argument("--out", type=Path, default=PAGE, help="the page to write")
    arguments = parser.parse_args()
    lines = []
    for task in TASKS:
        settings = Settings(task, steps=int(arguments.steps))
        of_task, versions = section(settings, arguments.python, arguments.seeds)
        lines += of_task
        # Each world takes half an hour: what the first has brought is there whatever comes of the next.
        arguments.out.write_text(page(settings, arguments.seeds, versions, lines))
    print(arguments.out.read_text())


def page(settings: Settings, seeds: int, versions: Mapping[str, str], lines: list[str]) -> str:
    """What was measured how, and the tables."""
    head = HEAD.format(
        machine=cpu_model(),
        software=software(versions),
        steps=settings.steps,
        last=seeds - 1,
        updates=settings.updates,
        batch=settings.batch_size,
        lived=settings.episodes * EPISODE,
        rate=settings.learning_rate,
        discount=settings.discount,
        scored=settings.scored,
    )
    return head + "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
