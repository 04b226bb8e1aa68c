"""Comparisons of algorithms as tables, in Markdown for people and CSV for programs."""

import csv
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from skillcrew.analysis.comparison import interquartile_interval, probability_of_improvement
from skillcrew.experiment.files import write_whole
from skillcrew.intervals import Interval, seed_interval


@dataclass(frozen=True, eq=False)
class Entry:
    """What one method reached in one environment, seed by seed."""

    environment: str
    method: str
    seeds: tuple[int, ...]
    steps: int
    """Environment steps per seed that it was given; methods of one environment may differ."""
    success: Float[np.ndarray, " seeds"]
    """Of the last champion, on fresh episodes: what it reached with all of its own steps."""
    area: Float[np.ndarray, " seeds"]
    """Mean of the learning curve from 0 to the smallest `steps` of all methods in the environment: beyond it
    whoever was given more would be paid for a longer plateau."""
    steps_to_half: Float[np.ndarray, " seeds"]
    """Environment steps to a success of 0.5; NaN where it was never reached."""
    steps_to_nine_tenths: Float[np.ndarray, " seeds"]


def write_tables(folder: Path, entries: Sequence[Entry]) -> list[Path]:
    """Writes `table.md` and `table.csv` into a folder.

    Args:
        entries: every method in every environment; the first method is what others are compared with.
    """
    markdown, plain = folder / "table.md", folder / "table.csv"
    text = markdown_table(entries)
    write_whole(markdown, lambda path: path.write_text(text))
    write_whole(plain, lambda path: _write_csv(path, entries))
    return [markdown, plain]


def markdown_table(entries: Sequence[Entry]) -> str:
    """The comparison in Markdown: one table of all, who is ahead where, and the methods over all tasks."""
    reference = entries[0].method
    lines = [
        "| environment | method | final success | interquartile mean | area under curve | steps to 0.5 "
        f"| steps to 0.9 | better than {reference} |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for entry in entries:
        against = _find(entries, entry.environment, reference)
        better = "" if entry is against else _range(_improvement([entry], [against]))
        cells = [
            entry.environment,
            entry.method,
            _range(seed_interval(entry.success)),
            _range(interquartile_interval(entry.success[None])),
            _range(seed_interval(entry.area)),
            _steps(entry.steps_to_half),
            _steps(entry.steps_to_nine_tenths),
            better,
        ]
        lines.append("| " + " | ".join(cells) + " |")
    lines += ["", *_footnotes(entries), "", *_ahead(entries, reference), "", *_over_all(entries, reference)]
    return "\n".join(lines) + "\n"


def _footnotes(entries: Sequence[Entry]) -> list[str]:
    budgets = _budgets(entries)
    given = ", ".join(_given(environment, steps) for environment, steps in budgets.items())
    return [
        f"Seeds {', '.join(map(str, entries[0].seeds))}; environment steps per seed: {given}. Brackets are "
        "95 % intervals over seeds: Student's t for means, the stratified bootstrap for interquartile means "
        "and for the probability that a seed of the method ends with more success than one of the method it "
        f"is compared with. The area is the mean height of the learning curve{_horizons(budgets)}. "
        "Steps are means over the seeds that got there, and how many did.",
    ]


def _horizons(budgets: Mapping[str, Mapping[str, int]]) -> str:
    """How far areas reach, where a method was given fewer steps than another."""
    common = ", ".join(
        f"{min(steps.values()) / 1e6:g} M in {environment}"
        for environment, steps in budgets.items()
        if len(set(steps.values())) > 1
    )
    if not common:
        return ""
    return (
        f" up to the smallest budget where budgets differ ({common}); final success is at the end of a "
        "method's own budget"
    )


def _budgets(entries: Sequence[Entry]) -> dict[str, dict[str, int]]:
    """For each environment the environment steps per seed of each of its methods."""
    budgets: dict[str, dict[str, int]] = {}
    for entry in entries:
        budgets.setdefault(entry.environment, {})[entry.method] = entry.steps
    return budgets


def _given(environment: str, budgets: Mapping[str, int]) -> str:
    """`40 M in rover-t3-c3 (5 M for MADyS+)`: what most methods were given, and then the others."""
    given = list(budgets.values())
    # Of budgets that are as common, the largest.
    usual = max(given, key=lambda steps: (given.count(steps), steps))
    others: dict[int, list[str]] = {}
    for method, steps in budgets.items():
        if steps != usual:
            others.setdefault(steps, []).append(method)
    exceptions = ", ".join(f"{steps / 1e6:g} M for {' and '.join(names)}" for steps, names in others.items())
    return f"{usual / 1e6:g} M in {environment}" + (f" ({exceptions})" if others else "")


def _ahead(entries: Sequence[Entry], reference: str) -> list[str]:
    """Whether the reference method's area is above each other's, with intervals that do not overlap."""
    lines = [
        f"| environment | area: {reference} against | difference | intervals apart |",
        "|---|---|---|---|",
    ]
    for entry in entries:
        against = _find(entries, entry.environment, reference)
        if entry is not against:
            ours, theirs = seed_interval(against.area), seed_interval(entry.area)
            apart = "yes" if ours.low > theirs.high or theirs.low > ours.high else "no"
            difference = f"{ours.mean - theirs.mean:+.3f}"
            lines.append(f"| {entry.environment} | {entry.method} | {difference} | {apart} |")
    return lines


def _over_all(entries: Sequence[Entry], reference: str) -> list[str]:
    """The methods over all environments together."""
    lines = [
        f"| all environments | interquartile mean of final success | better than {reference} |",
        "|---|---|---|",
    ]
    of_reference = [entry for entry in entries if entry.method == reference]
    for method in dict.fromkeys(entry.method for entry in entries):
        mine = [entry for entry in entries if entry.method == method]
        better = "" if method == reference else _range(_improvement(mine, of_reference))
        middle = interquartile_interval(np.stack([entry.success for entry in mine]))
        lines.append(f"| {method} | {_range(middle)} | {better} |")
    return lines


def _improvement(entries: Sequence[Entry], others: Sequence[Entry]) -> Interval:
    return probability_of_improvement(
        np.stack([entry.success for entry in entries]), np.stack([entry.success for entry in others])
    )


def _find(entries: Sequence[Entry], environment: str, method: str) -> Entry:
    return next(entry for entry in entries if (entry.environment, entry.method) == (environment, method))


def _range(interval: Interval) -> str:
    if math.isnan(interval.low):
        return f"{interval.mean:.3f}"
    return f"{interval.mean:.3f} [{interval.low:.3f}, {interval.high:.3f}]"


def _steps(steps: Float[np.ndarray, " seeds"]) -> str:
    reached = steps[~np.isnan(steps)]
    if not len(reached):
        return "not reached"
    counted = "" if len(reached) == len(steps) else f" ({len(reached)} of {len(steps)} seeds)"
    return f"{reached.mean() / 1e6:.2f} M{counted}"


def _write_csv(path: Path, entries: Sequence[Entry]) -> None:
    columns = ("success", "area", "steps_to_half", "steps_to_nine_tenths")
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(("environment", "method", "seed", "steps", *columns))
        for entry in entries:
            for index, seed in enumerate(entry.seeds):
                values = [float(getattr(entry, column)[index]) for column in columns]
                writer.writerow((entry.environment, entry.method, seed, entry.steps, *values))
