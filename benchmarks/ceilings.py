"""What looking is worth in each task: told teams, MADyS+ and timetables, from the folder of a reproduction.

    python -m benchmarks.ceilings runs/frontier > results/frontier/ceilings.md

Told teams act by the skills that MADyS+ had in the end, so that both are measured on the same ones.
"""

import json
import sys
from pathlib import Path

import jax
import numpy as np
from benchmarks.told import told_shares

from skillcrew.experiment.reproduction import SETS, environments_of, steps_of
from skillcrew.experiment.run import Run

EPISODES = 1000
METHODS = ("madys-plus", "open-loop", "open-loop-team")


def told(folder: Path) -> dict[str, float]:
    """The mean over a run's seeds of what each variant of told teams finishes."""
    run = Run(folder)
    shares = [
        told_shares(run.algorithm.env, run.champion(seed).skills, jax.random.key(seed), EPISODES)
        for seed in run.config.seeds
    ]
    return {variant: float(np.mean([share[variant] for share in shares])) for variant in shares[0]}


def success(folder: Path, steps: int) -> str:
    scores = folder / "report" / "scores.json"
    if not scores.is_file():
        return "not run yet"
    seeds = [seed["mean"] for seed in json.loads(scores.read_text())["success_rate"]["per_seed"]]
    return f"{np.mean(seeds):.3f} ({min(seeds):.3f} to {max(seeds):.3f}) after {steps / 1e6:g} M"


def main() -> int:
    if len(sys.argv) != 2:
        print(__doc__, file=sys.stderr)
        return 2
    runs = Path(sys.argv[1]) / "runs"
    print("| task | told, together | told, split | MADyS+ | timetables, one each | one for all |")
    print("|---|---|---|---|---|---|")
    for environment in (name for figure in SETS["frontier"] for name in environments_of(figure)):
        best = runs / environment / METHODS[0]
        if not (best / "report" / "scores.json").is_file():
            continue
        ceilings = told(best)
        cells = [
            f"{ceilings[variant]:.3f}" if variant in ceilings else "" for variant in ("together", "split")
        ]
        budgets = steps_of(environment)
        for method in METHODS:
            cells.append(success(runs / environment / method, budgets[method]))
        print(f"| `{environment}` | " + " | ".join(cells) + " |", flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
