"""COMA on two repeated matrix games: ours, LIIR and PPO beside EPyMARL's COMA, after as many steps.

    python -m benchmarks.epymarl CHECKOUT --python VENV/bin/python     # a checkout of uoe-agents/epymarl

EPyMARL's `src/main.py` is started as it lies there, with its own settings; ours have theirs. One thing after
the other, all on one core. Prints a page and writes it to `results/epymarl.md`.
"""

import argparse
import json
import os
import subprocess
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from benchmarks.checkout import commit
from benchmarks.machine import cpu_model, software, versions
from benchmarks.matrix_games import GAMES, LENGTH, best, by_chance
from benchmarks.talking import ROOT, say

PAGE = Path(__file__).parent / "results" / "epymarl.md"
OURS = {"our COMA": "coma", "our LIIR": "liir", "our IPPO": "ippo", "our MAPPO": "mappo"}
THEIRS = "EPyMARL's COMA"
SCORED = 100
"""Fresh episodes for each seed's score."""
NOT_NEEDED = "smaclite"
"""A simulator that EPyMARL imports whatever it is asked for."""
HEAD = """# COMA beside EPyMARL's

{machine}; {software}; EPyMARL at {commit}. One core.

Repeated matrix games of {length} rounds, {steps:,} environment steps, seeds 0 to {last}; each side's own
defaults. Mean returns of {scored} fresh episodes, in which both draw their choices as they learned to.
Seconds are one seed's, elapsed; EPyMARL's with its start, ours without compiling: all seeds are one program,
which compiles in {compiling:.0f} s.
"""


def theirs(checkout: Path, python: Path, game: str, seed: int, steps: int) -> tuple[float, float]:
    """What EPyMARL's COMA returns in its last test, and how many seconds it took."""
    options: dict[str, Any] = {
        "env_args.key": f"benchmarks.epymarl_theirs:{game}-v0",
        "env_args.time_limit": LENGTH,
        # Both agents are paid what the team is.
        "reward_scalarisation": "mean",
        "use_cuda": False,
        "t_max": steps,
        "test_interval": steps // 2,
        "test_nepisode": SCORED,
        "log_interval": steps // 2,
        "seed": seed,
    }
    words = [
        "--config=coma",
        "--env-config=gymma",
        "with",
        *(f"{name}={value}" for name, value in options.items()),
    ]
    with tempfile.TemporaryDirectory() as place:
        (Path(place) / f"{NOT_NEEDED}.py").touch()
        began = time.monotonic()
        run = subprocess.run(
            [str(python.absolute()), "-W", "ignore", str(checkout / "src" / "main.py"), *words],
            env={**os.environ, "PYTHONPATH": os.pathsep.join((str(ROOT), place)), "OMP_NUM_THREADS": "1"},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        seconds = time.monotonic() - began
    # What it prints is a mean of up to five tests, the untrained team's among them.
    records = (checkout / "results" / "sacred" / "coma" / options["env_args.key"]).glob("*/info.json")
    newest = max(records, key=lambda path: path.stat().st_mtime, default=None)
    if run.returncode or newest is None:
        raise SystemExit(f"EPyMARL stopped:\n{run.stdout[-2000:]}")
    tested = json.loads(newest.read_text())["test_return_mean"][-1]
    return float(tested["value"] if isinstance(tested, dict) else tested), seconds


def row(title: str, returns: list[float], seconds: float, steps: int, peer: float) -> str:
    """A line of a table; `peer` is EPyMARL's seconds."""
    each = " ".join(f"{value:.1f}" for value in returns)
    rate = f"{steps / seconds:,.0f}"
    return f"| {title} | {each} | {np.mean(returns):.1f} | {seconds:.1f} | {rate} | {peer / seconds:.0f} |"


def section(game: str, options: argparse.Namespace) -> tuple[list[str], float]:
    """Lines about one game, and the mean of seconds for compiling."""
    from benchmarks.epymarl_ours import train

    of_peer = []
    for seed in range(options.seeds):
        of_peer.append(theirs(options.checkout, options.python, game, seed, options.steps))
        say(f"{game}, seed {seed}, {THEIRS}: {of_peer[-1][0]:g}, {of_peer[-1][1]:.0f} s")
    peer = float(np.mean([seconds for _, seconds in of_peer]))
    rows = [row(THEIRS, [returned for returned, _ in of_peer], peer, options.steps, peer)]
    compiling = []
    for title, algorithm in OURS.items():
        returns, seconds, compiled = train(algorithm, game, options.seeds, options.steps, SCORED)
        say(f"{game}, {title}: {returns}, {seconds:.0f} s")
        rows.append(row(title, returns, seconds / options.seeds, options.steps, peer))
        compiling.append(compiled)
    payoff = "; ".join(" ".join(map(str, line)) for line in GAMES[game])
    lines = [
        f"\n## `{game}`\n",
        f"Pays {payoff}. The best pair returns {best(game)}, choices by chance {by_chance(game):.0f}.\n",
        "| method | return, each seed | mean | seconds | steps per second | times EPyMARL's |",
        "|---|---|---|---|---|---|",
        *rows,
    ]
    return lines, float(np.mean(compiling))


def page(options: argparse.Namespace, found: Mapping[str, str], lines: list[str], compiling: float) -> str:
    """What was measured how, and the tables."""
    head = HEAD.format(
        machine=cpu_model(),
        software=software(dict(found)),
        commit=commit(options.checkout, "src")[:7],
        length=LENGTH,
        steps=options.steps,
        last=options.seeds - 1,
        scored=SCORED,
        compiling=compiling,
    )
    return head + "\n".join(lines) + "\n"


def main() -> None:
    """Measures, prints and writes the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("checkout", type=Path, help="a checkout of uoe-agents/epymarl")
    parser.add_argument(
        "--python", type=Path, required=True, help="the interpreter that has what EPyMARL needs"
    )
    parser.add_argument("--games", nargs="+", choices=GAMES, default=["climbing", "penalty-25"])
    parser.add_argument("--seeds", type=int, default=5, help="seeds of each method (default 5)")
    parser.add_argument("--steps", type=lambda text: int(float(text)), default=100_000, help="default 1e5")
    parser.add_argument("--out", type=Path, default=PAGE, help="the page to write")
    options = parser.parse_args()
    options.checkout = options.checkout.absolute()
    commit(options.checkout, "src")
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    lines, compiling = [], []
    for game in options.games:
        of_game, compiled = section(game, options)
        lines += of_game
        compiling.append(compiled)
        found = versions(("jax", "skillcrew"))
        options.out.write_text(page(options, found, lines, float(np.mean(compiling))))
    print(options.out.read_text())


if __name__ == "__main__":
    main()
