"""Environment steps per second on one thread: ours beside JaxMARL and VMAS, in one run.

    pip install -e . -r benchmarks/requirements-peers.txt
    python -m benchmarks.stepping

One environment step is one step of one world with all its agents, under uniform random actions
that are drawn as part of it, with one reset every 50 steps included. Each side runs in a process
of its own, all of them pinned to the same core and strictly one at a time; repetitions go round
the sides, so that a disturbance of the machine meets all of them. A peer that is not installed
is left out. Exits with 1 when a ratio to a peer is below what we hold ourselves to.
"""

import argparse
import collections
import statistics
import sys
from pathlib import Path

from benchmarks import machine
from benchmarks.talking import Process

HERE = Path(__file__).parent
BARS = {"jaxmarl": 3.0, "vmas": 20.0}
"""How many times a peer's environment steps per second we must reach."""
TITLES = {
    "skillcrew": "skillcrew Rover Domain",
    "jaxmarl": "JaxMARL MPE `simple_spread`, continuous",
    "vmas": "VMAS `discovery`",
}

Samples = dict[tuple[str, str], list[dict[str, float]]]
"""The repetitions of each side and case, in the order of the rounds."""


class Worker(Process):
    """One side's process. It works only while `measure` waits for it."""

    def __init__(self, side: str, seconds: float, candidates: list[int]):
        words = [side, str(seconds), *map(str, candidates)]
        super().__init__(side, [sys.executable, "-m", "benchmarks.stepping_sides", *words])
        self.missing: str | None = self.ready.get("missing")
        """The module that this side lacks, if any; it then has no worlds."""
        self.worlds: dict[str, int] = self.ready.get("worlds", {})
        self.versions: dict[str, str] = self.ready.get("versions", {})

    def measure(self, case: str) -> dict[str, float]:
        """One repetition of one case: its rate, and the share of the core that it got."""
        return self.ask(case=case)


def start(seconds: float, candidates: list[int]) -> dict[str, Worker]:
    """Starts the sides one after the other, and says which are not there."""
    workers = {}
    for side in TITLES:
        print(f"{side}: compiling, choosing the number of worlds ...", file=sys.stderr, flush=True)
        worker = Worker(side, seconds, candidates)
        if not worker.missing:
            workers[side] = worker
            continue
        worker.close()
        if side == "skillcrew":
            raise SystemExit(f"skillcrew: module {worker.missing} is missing; pip install -e . first")
        print(missing_line(side, worker.missing), file=sys.stderr)
    return workers


def missing_line(side: str, module: str) -> str:
    """What to tell when a peer cannot be measured."""
    return f"{side}: left out, module {module} is missing; pip install -r benchmarks/requirements-peers.txt"


def measure(workers: dict[str, Worker], rounds: int) -> Samples:
    """All repetitions: in each round every case once, sides with the same case side by side."""
    cases = list(workers["skillcrew"].worlds)
    samples: Samples = collections.defaultdict(list)
    for number in range(rounds):
        print(f"round {number + 1} of {rounds}", file=sys.stderr, flush=True)
        for case in cases:
            for side, worker in workers.items():
                if case in worker.worlds:
                    samples[side, case].append(worker.measure(case))
    return samples


def ratios(samples: Samples, side: str, case: str) -> list[float]:
    """Ours over a side, round by round: what both sides met in a round cancels."""
    ours = samples["skillcrew", agents_of(case)]
    return [mine["rate"] / other["rate"] for mine, other in zip(ours, samples[side, case], strict=True)]


def agents_of(case: str) -> str:
    """The case that a variant such as "2 agents, vmap" is a variant of."""
    return case.split(",")[0]


def spread(values: list[float], form: str) -> str:
    """Median, and minimum to maximum."""
    low, middle, high = (format(f(values), form) for f in (min, statistics.median, max))
    return f"{middle} ({low} to {high})"


HEADER = """\
| environment | agents | worlds | thousand environment steps per second | ours is faster by | share of the core |
|---|---|---|---|---|---|"""  # noqa: E501


def table(samples: Samples, workers: dict[str, Worker]) -> str:
    """One Markdown row per side and case, ordered by the number of agents."""
    lines = [HEADER]
    sides = list(TITLES)
    for side, case in sorted(samples, key=lambda pair: (agents_of(pair[1]), sides.index(pair[0]))):
        title = TITLES[side] + (", through `jax.vmap`" if case.endswith("vmap") else "")
        rows = samples[side, case]
        itself = side == "skillcrew" and case == agents_of(case)
        faster = "" if itself else spread(ratios(samples, side, case), ".1f") + " times"
        share = statistics.median(row["share"] for row in rows)
        rates = spread([row["rate"] / 1e3 for row in rows], ",.0f")
        cells = (title, case.split()[0], workers[side].worlds[case], rates, faster, f"{share:.0%}")
        lines.append("| " + " | ".join(str(cell) for cell in cells) + " |")
    return "\n".join(lines)


PAGE = """\
# Environment stepping, one thread

- Machine: {machine}; every side pinned to the same single core.
- Software: {software}.
- {rounds} rounds; in each, every side and case in turn for about {seconds:g} s, and at least one episode.
  Shown are median (minimum to maximum) over the rounds; ratios are taken round by round.
- Worlds: the fastest of {worlds}, for each row.
- Seconds are processor time. Share of the core: processor time over elapsed time; what is missing from 100 %,
  other programs took.
{table}

Written by `python -m benchmarks.stepping`; [the notes](../README.md) say what is compared.
"""


def report(samples: Samples, workers: dict[str, Worker], arguments: argparse.Namespace) -> str:
    """The whole result as a Markdown page."""
    found = {name: version for worker in workers.values() for name, version in worker.versions.items()}
    absent = [f"- Not installed, left out: {side}.\n" for side in TITLES if side not in workers]
    return PAGE.format(
        machine=machine.cpu_model(),
        software=machine.software(found),
        rounds=arguments.rounds,
        seconds=arguments.seconds,
        worlds=", ".join(map(str, arguments.worlds)),
        table="".join(absent) + "\n" + table(samples, workers),
    )


def missed_bars(samples: Samples) -> list[str]:
    """One line per comparison whose median ratio is below its bar."""
    missed = []
    for side, case in samples:
        if side in BARS and (ratio := statistics.median(ratios(samples, side, case))) < BARS[side]:
            missed.append(f"{side}, {case}: {ratio:.1f} times, below the bar of {BARS[side]:g}")
    return missed


def parse() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--rounds", type=int, default=7, help="repetitions of every case (default 7)")
    parser.add_argument("--seconds", type=float, default=1.0, help="length of a repetition (default 1)")
    parser.add_argument(
        "--worlds", type=int, nargs="+", default=[256, 1024, 4096], help="numbers of worlds to choose from"
    )
    parser.add_argument(
        "--out", type=Path, help="the page to write (default: benchmarks/results/stepping.md)"
    )
    return parser.parse_args()


def write(page: str, out: Path | None, complete: bool) -> None:
    """Writes the page; the default one is kept when a peer is missing, for it would lose rows."""
    if out is None and not complete:
        print("some peers are missing: the page is printed and not written", file=sys.stderr)
        return
    out = out or HERE / "results" / "stepping.md"
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_text(page)


def main() -> int:
    """Measures, prints and writes the page; 1 if a bar is missed."""
    arguments = parse()
    workers = start(arguments.seconds, arguments.worlds)
    try:
        samples = measure(workers, arguments.rounds)
    finally:
        for worker in workers.values():
            worker.close()
    page = report(samples, workers, arguments)
    print(page)
    write(page, arguments.out, complete=len(workers) == len(TITLES))
    missed = missed_bars(samples)
    print("\n".join(missed) or "no bar missed", file=sys.stderr)
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
