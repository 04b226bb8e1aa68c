"""COMA and LIIR on two repeated matrix games: ours and PPO beside EPyMARL's COMA and the LIIR of its authors.

    python -m benchmarks.matrix_peers --epymarl CHECKOUT --liir CHECKOUT --python VENV/bin/python

Checkouts of uoe-agents/epymarl and yalidu/liir, whose programs are started as they lie there, with their own
settings; ours have theirs. All live as many steps, one thing after the other, on one core. Prints a page
and writes it to `results/matrix_peers.md`.
"""

import argparse
import dataclasses
import functools
import json
import os
import subprocess
import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from benchmarks.checkout import commit
from benchmarks.machine import cpu_model, software, versions
from benchmarks.matrix_games import GAMES, LENGTH, best, by_chance
from benchmarks.talking import ROOT, say

PAGE = Path(__file__).parent / "results" / "matrix_peers.md"
OURS = {"our COMA": "coma", "our LIIR": "liir", "our IPPO": "ippo", "our MAPPO": "mappo"}
PEERS = {"our COMA": "EPyMARL's COMA", "our LIIR": "its authors' LIIR"}
"""Beside what each of ours stands."""
SCORED = 160
"""Fresh episodes for each seed's score. EPyMARL lives 10 at a time, LIIR's authors 32."""
NOT_NEEDED = "smaclite"
"""A simulator that EPyMARL imports whatever it is asked for."""
HEAD = """# COMA and LIIR beside others'

{machine}; {software}; {peers}. One core.

Repeated matrix games of {length} rounds, {steps:,} environment steps, seeds 0 to {last}; each side's own
defaults. Mean returns of {scored} fresh episodes, in which both draw their choices as they learned to.
Seconds are one seed's, elapsed; others' with their start, ours without compiling: all seeds are one program,
which compiles in {compiling:.0f} s.
"""

Lived = tuple[float, float]
"""What a seed's team returns in its last test, and how many seconds it took."""


@dataclasses.dataclass(frozen=True)
class Peer:
    """Another project's program."""

    title: str
    project: str
    checkout: Path
    live: Callable[[str, int, int], Lived]
    """Of a game, a seed, and environment steps."""


def epymarl(checkout: Path, python: Path, game: str, seed: int, steps: int) -> Lived:
    """EPyMARL's COMA."""
    options: dict[str, Any] = {
        "env_args.key": f"benchmarks.epymarl_theirs:{game}-v0",
        "env_args.time_limit": LENGTH,
        # Both agents are paid what the team is.
        "reward_scalarisation": "mean",
        **_tested(steps, seed),
    }
    program = [str(checkout / "src" / "main.py"), "--config=coma", "--env-config=gymma", "with"]
    results = Path("coma") / options["env_args.key"]
    return _lived(checkout, python, [*program, *_words(options)], results)


def liir(checkout: Path, python: Path, game: str, seed: int, steps: int) -> Lived:
    """LIIR by its authors."""
    options = {
        "use_tensorboard": False,
        "save_model": False,
        "test_greedy": False,
        "runner_log_interval": steps // 2,
        "learner_log_interval": steps // 2,
        **_tested(steps, seed),
    }
    program = [str(ROOT / "benchmarks" / "liir_theirs.py"), str(checkout), game]
    return _lived(checkout, python, [*program, *_words(options)], Path(f"liir_smac_{game}_*"))


def _tested(steps: int, seed: int) -> dict[str, Any]:
    """Options of PyMARL, from which both come: how long, and when it is tested."""
    return {
        "use_cuda": False,
        "t_max": steps,
        "test_interval": steps // 2,
        "test_nepisode": SCORED,
        "log_interval": steps // 2,
        "seed": seed,
    }


def _words(options: Mapping[str, Any]) -> list[str]:
    return [f"{name}={value}" for name, value in options.items()]


def _lived(checkout: Path, python: Path, words: list[str], results: Path) -> Lived:
    """Starts a program, and reads the newest record that it left."""
    with tempfile.TemporaryDirectory() as place:
        (Path(place) / f"{NOT_NEEDED}.py").touch()
        began = time.monotonic()
        run = subprocess.run(
            [str(python.absolute()), "-W", "ignore", *words],
            env={**os.environ, "PYTHONPATH": os.pathsep.join((str(ROOT), place)), "OMP_NUM_THREADS": "1"},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        seconds = time.monotonic() - began
    # What it prints is a mean of up to five tests, the untrained team's among them.
    records = (checkout / "results" / "sacred").glob(f"{results}/*/info.json")
    newest = max(records, key=lambda path: path.stat().st_mtime, default=None)
    if run.returncode or newest is None:
        raise SystemExit(f"{words[0]} stopped:\n{run.stdout[-2000:]}")
    tested = json.loads(newest.read_text())["test_return_mean"][-1]
    return float(tested["value"] if isinstance(tested, dict) else tested), seconds


def row(title: str, returns: list[float], seconds: float, steps: int, peer: float | None) -> str:
    """A line of a table; `peer` is the seconds of what it stands beside."""
    each = " ".join(f"{value:.1f}" for value in returns)
    times = "" if peer is None else f"{peer / seconds:.0f}"
    return f"| {title} | {each} | {np.mean(returns):.1f} | {seconds:.1f} | {steps / seconds:,.0f} | {times} |"


def section(game: str, peers: list[Peer], seeds: int, steps: int) -> tuple[list[str], float]:
    """Lines about one game, and the mean of seconds for compiling."""
    from benchmarks.matrix_ours import train

    rows, needed = [], {}
    for peer in peers:
        lived = []
        for seed in range(seeds):
            lived.append(peer.live(game, seed, steps))
            say(f"{game}, seed {seed}, {peer.title}: {lived[-1][0]:g}, {lived[-1][1]:.0f} s")
        needed[peer.title] = float(np.mean([seconds for _, seconds in lived]))
        rows.append(row(peer.title, [returned for returned, _ in lived], needed[peer.title], steps, None))
    compiling = []
    for title, algorithm in OURS.items():
        returns, seconds, compiled = train(algorithm, game, seeds, steps, SCORED)
        say(f"{game}, {title}: {returns}, {seconds:.0f} s")
        rows.append(row(title, returns, seconds / seeds, steps, needed.get(PEERS.get(title, ""))))
        compiling.append(compiled)
    payoff = "; ".join(" ".join(map(str, line)) for line in GAMES[game])
    lines = [
        f"\n## `{game}`\n",
        f"Pays {payoff}. The best pair returns {best(game)}, choices by chance {by_chance(game):.0f}.\n",
        "| method | return, each seed | mean | seconds | steps per second | times its peer's |",
        "|---|---|---|---|---|---|",
        *rows,
    ]
    return lines, float(np.mean(compiling))


def page(
    peers: list[Peer],
    options: argparse.Namespace,
    found: Mapping[str, str],
    lines: list[str],
    compiling: float,
) -> str:
    """What was measured how, and the tables."""
    head = HEAD.format(
        machine=cpu_model(),
        software=software(dict(found)),
        peers=", ".join(f"{peer.project} at {commit(peer.checkout, 'src')[:7]}" for peer in peers),
        length=LENGTH,
        steps=options.steps,
        last=options.seeds - 1,
        scored=SCORED,
        compiling=compiling,
    )
    return head + "\n".join(lines) + "\n"


def peers_of(options: argparse.Namespace) -> list[Peer]:
    """Those whose checkouts were given.

    Raises:
        SystemExit: a checkout is none, or was changed.
    """
    known = (("EPyMARL's COMA", "EPyMARL", epymarl), ("its authors' LIIR", "LIIR", liir))
    found = []
    for title, project, program in known:
        checkout = getattr(options, program.__name__)
        if checkout is not None:
            checkout = checkout.absolute()
            commit(checkout, "src")
            live = functools.partial(program, checkout, options.python)
            found.append(Peer(title, project, checkout, live))
    return found


def main() -> None:
    """Measures, prints and writes the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--epymarl", type=Path, help="a checkout of uoe-agents/epymarl; without it none")
    parser.add_argument("--liir", type=Path, help="a checkout of yalidu/liir; without it none")
    parser.add_argument(
        "--python", type=Path, required=True, help="the interpreter that has what both of them need"
    )
    parser.add_argument("--games", nargs="+", choices=GAMES, default=["climbing", "penalty-25"])
    parser.add_argument("--seeds", type=int, default=5, help="seeds of each method (default 5)")
    parser.add_argument("--steps", type=lambda text: int(float(text)), default=100_000, help="default 1e5")
    parser.add_argument("--out", type=Path, default=PAGE, help="the page to write")
    options = parser.parse_args()
    peers = peers_of(options)
    if not peers:
        parser.error("nobody to stand beside: give --epymarl or --liir, or both")
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    lines, compiling = [], []
    for game in options.games:
        of_game, compiled = section(game, peers, options.seeds, options.steps)
        lines += of_game
        compiling.append(compiled)
        found = versions(("jax", "skillcrew"))
        options.out.write_text(page(peers, options, found, lines, float(np.mean(compiling))))
    print(options.out.read_text())


if __name__ == "__main__":
    main()
