"""What looking is worth in each task: told teams, timetables and MADyS+, from the folder of a reproduction.

    python -m benchmarks.ceilings runs/frontier > results/frontier/ceilings.md

Told teams and timetables act by the skills that MADyS+ had in the end, so that all are measured on the same
ones. Timetables are searched for by the open loop, three times for ten million environment steps, on skills
of the run's first seed.
"""

import dataclasses
import json
import sys
from pathlib import Path

import jax
import numpy as np
from benchmarks.search_alone import search
from benchmarks.told import GUESSING, SPLIT, TOGETHER, told_shares

from skillcrew.algorithms.open_loop import OpenLoop, OpenLoopConfig
from skillcrew.experiment.figures import SETS, panels_of
from skillcrew.experiment.run import Run

EPISODES = 1000
STEPS = 10_000_000
VARIANTS = (TOGETHER, SPLIT, GUESSING)


def told(folder: Path) -> dict[str, float]:
    """The mean over a run's seeds of what each variant of told teams finishes."""
    run = Run(folder)
    shares = [
        told_shares(run.algorithm.env, run.champion(seed).skills, jax.random.key(seed), EPISODES)
        for seed in run.config.seeds
    ]
    return {variant: float(np.mean([share[variant] for share in shares])) for variant in shares[0]}


def timetables(folder: Path, sharing: str) -> list[float]:
    """What the timetables found by three searches finish."""
    run = Run(folder)
    selector = dataclasses.replace(OpenLoopConfig().selector, sharing=sharing)
    skills = run.champion(run.config.seeds[0]).skills
    return [final for _, _, final in search(OpenLoop(run.algorithm.env, selector=selector), skills, STEPS)]


def success(folder: Path) -> str:
    scores = json.loads((folder / "report" / "scores.json").read_text())["success_rate"]
    seeds = [seed["mean"] for seed in scores["per_seed"]]
    steps = Run(folder).config.steps
    return f"{np.mean(seeds):.3f} ({min(seeds):.3f} to {max(seeds):.3f}) after {steps / 1e6:g} M"


def main() -> int:
    if len(sys.argv) != 2:
        print(__doc__, file=sys.stderr)
        return 2
    runs = Path(sys.argv[1]) / "runs"
    print("| task | told, together | split | guessing | timetables, one each | one for all | MADyS+ |")
    print("|---|---|---|---|---|---|---|")
    for environment in (name for figure in SETS["frontier"] for name in panels_of(figure)):
        best = runs / environment / "madys-plus"
        if not (best / "report" / "scores.json").is_file():
            continue
        ceilings = told(best)
        cells = [f"{ceilings[variant]:.3f}" if variant in ceilings else "" for variant in VARIANTS]
        for sharing in ("agent", "team"):
            cells.append(" ".join(f"{share:.3f}" for share in timetables(best, sharing)))
        cells.append(success(best))
        print(f"| `{environment}` | " + " | ".join(cells) + " |", flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
