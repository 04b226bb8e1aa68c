"""What it saves to begin with another run's skills or team: MADyS+ from nothing and from smaller tasks.

    python -m benchmarks.warm_starts [--seeds 2000..2004] [--before 1e6] [--steps 3e6] > warm_starts.md

Two tables: `rover-t3-c3` with the skills of `rover-t2-c2`; twelve rovers (`rover-t3-c6`) with skills and team
of six (`rover-t3-c3`), whose timetables all rovers of a team share. Steps of the smaller task are told apart
from those of the larger one. Runs are kept in `--out`: what was interrupted goes on, what is done stays.
"""

import argparse
import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from benchmarks.machine import cpu_model

import skillcrew as sc
from skillcrew.analysis.levels import Windows, reaching, restricted_mean
from skillcrew.analysis.report import learning_curve
from skillcrew.cli.arguments import parse_count, parse_seeds
from skillcrew.experiment.progress import human

LEVELS = (0.5, 0.9)


@dataclasses.dataclass(frozen=True)
class Transfer:
    """A larger task, a smaller one, and what is taken over of it."""

    larger: str
    smaller: str
    sharing: Any
    variants: Mapping[str, Mapping[str, Any]]
    """By name: whether skills and team are taken over, and other options of a run."""

    def algorithm(self, environment: str) -> sc.MADySPlus:
        """The same in both tasks."""
        selector = dataclasses.replace(sc.MADySPlusConfig().selector, sharing=self.sharing)
        return sc.MADySPlus(sc.make(environment), selector=selector)


SKILLS = {"from nothing": {}, "skills": {"skills": True}}
FROZEN = {"skills": True, "skills_frozen": True}
TRANSFERS = (
    Transfer("rover-t3-c3", "rover-t2-c2", "agent", {**SKILLS, "skills, frozen": FROZEN}),
    Transfer(
        "rover-t3-c6",
        "rover-t3-c3",
        "team",
        {
            **SKILLS,
            "skills and team": {"skills": True, "team": True},
            "skills, frozen, and team": {**FROZEN, "team": True},
        },
    ),
)


def trained(folder: Path, algorithm: sc.MADySPlus, seeds: Any, steps: int, **options: Any) -> sc.Run:
    """A run to the end of its budget, whatever of it is there already."""
    if folder.exists():
        return sc.Run(folder).resume()
    return sc.train(algorithm, seeds, steps, folder, **options)


def row(name: str, run: sc.Run, episodes: int) -> str:
    """Steps to the levels, what had been spent before, and the success in the end."""
    windows = Windows.of(run.config.steps)
    cells = []
    for level in LEVELS:
        reached = [
            reaching(steps, values, level, windows, run.config.steps)
            for steps, values in learning_curve(run).per_seed
        ]
        mean, count = restricted_mean(reached)
        bound = "" if count == len(reached) else "above "
        cells.append(f"{bound}{human(mean)} ({count} of {len(reached)})")
    before = max((one.steps or 0 for one in (run.config.skills_from, run.config.team_from) if one), default=0)
    evaluation = run.evaluate(episodes)
    success = evaluation.score.range(evaluation.overall)
    return f"| {name} | {human(before)} | {' | '.join(cells)} | {success} |"


def table(transfer: Transfer, options: argparse.Namespace) -> None:
    """Trains what is missing and prints a line for each variant."""
    print(f"\n## `{transfer.larger}`, from `{transfer.smaller}`\n")
    levels = " | ".join(f"to {level:g}" for level in LEVELS)
    print(f"| begins with | steps before | steps {levels} | success in the end |\n|---|---|---|---|---|")
    folder = options.out / f"{transfer.smaller}-to-{transfer.larger}"
    source = folder / "before"
    trained(source, transfer.algorithm(transfer.smaller), options.seeds, options.before)
    for name, taken in transfer.variants.items():
        given = {key: value for key, value in taken.items() if key not in ("skills", "team")}
        given |= {f"{part}_from": source for part in ("skills", "team") if taken.get(part)}
        place = folder / name.replace(",", "").replace(" ", "-")
        run = trained(place, transfer.algorithm(transfer.larger), options.seeds, options.steps, **given)
        print(row(name, run, options.episodes), flush=True)


def main() -> None:
    """Prints a page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seeds", type=parse_seeds, default=parse_seeds("2000..2004"))
    parser.add_argument("--before", type=parse_count, default=1_000_000, help="steps of the smaller task")
    parser.add_argument("--steps", type=parse_count, default=3_000_000, help="of the larger one")
    parser.add_argument("--episodes", type=int, default=1000, help="of the score in the end")
    parser.add_argument("--out", type=Path, default=Path("runs/warm-starts"))
    options = parser.parse_args()
    print(f"# What warm starts save\n\n{cpu_model()}\n")
    print(f"MADyS+, seeds {', '.join(map(str, options.seeds))}. Means of the steps to a level that was held,")
    print(
        "and how many seeds held it; steps of the smaller task have a column and count nowhere else. Success"
    )
    print(f"on {options.episodes} fresh episodes per seed, with its 95 % interval over seeds.")
    for transfer in TRANSFERS:
        table(transfer, options)


if __name__ == "__main__":
    main()
