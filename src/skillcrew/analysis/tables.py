"""Comparisons of algorithms as tables, in Markdown for people and CSV for programs."""

import csv
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from skillcrew.analysis.comparison import interquartile_interval, probability_of_improvement
from skillcrew.analysis.levels import Reaching, restricted_mean
from skillcrew.experiment.files import write_whole
from skillcrew.experiment.score import SUCCESS, Score
from skillcrew.intervals import Interval

STEPS_COLUMNS = {0.5: "steps_to_half", 0.9: "steps_to_nine_tenths"}
"""Of a table for programs, by `Score.thresholds`."""

REACHING = (
    " Steps to a level are those after which a seed holds it, as a mean over all seeds. Where not all do, it "
    "says how many, and is a lower bound (>): the others count with the steps that they lived without."
)


@dataclass(frozen=True, eq=False)
class Entry:
    """What one method reached in one environment, seed by seed."""

    environment: str
    method: str
    seeds: tuple[int, ...]
    steps: int
    """Environment steps per seed that it was given; methods of one environment may differ."""
    final: Float[np.ndarray, " seeds"]
    """Score of the last champion, on fresh episodes: what it reached with all of its own steps."""
    episodes: int
    """Of each final score."""
    area: Float[np.ndarray, " seeds"]
    """Mean of the learning curve from 0 to the smallest `steps` of all methods in the environment: beyond it
    whoever was given more would be paid for a longer plateau."""
    steps_to: Mapping[float, Sequence[Reaching]]
    """For each threshold of the score when each seed reached it."""
    score: Score = SUCCESS
    """What is compared, the same in all entries of a table."""


def write_tables(folder: Path, entries: Sequence[Entry]) -> list[Path]:
    """Writes `table.md` and `table.csv` into a folder.

    Args:
        entries: methods in environments; the first method is what others are compared with.
    """
    markdown, plain = folder / "table.md", folder / "table.csv"
    text = markdown_table(entries)
    write_whole(markdown, lambda path: path.write_text(text))
    write_whole(plain, lambda path: _write_csv(path, entries))
    return [markdown, plain]


def markdown_table(entries: Sequence[Entry]) -> str:
    """The comparison in Markdown: one table of all, who is ahead where, and the methods over all tasks."""
    reference, score = entries[0].method, entries[0].score
    heading = [
        *("environment", "method", f"final {score.word}", "interquartile mean", "area under curve"),
        *(f"steps to {threshold:g}" for threshold in score.thresholds),
        f"better than {reference}",
    ]
    lines = ["| " + " | ".join(heading) + " |", "|" + len(heading) * "---|"]
    for entry in entries:
        against = _beside(entries, entry, reference)
        better = SUCCESS.range(_improvement([entry], [against])) if against else ""
        cells = [
            entry.environment,
            entry.method,
            score.range(score.over_seeds(entry.final, entry.episodes)),
            score.range(_middle([entry])),
            score.range(score.over_seeds(entry.area)),
            *(_steps(entry.steps_to[threshold]) for threshold in score.thresholds),
            better,
        ]
        lines.append("| " + " | ".join(cells) + " |")
    lines += [
        "",
        *_footnotes(entries),
        "",
        *_differences(entries, reference),
        "",
        *_over_all(entries, reference),
    ]
    return "\n".join(lines) + "\n"


def _footnotes(entries: Sequence[Entry]) -> list[str]:
    budgets, score = _budgets(entries), entries[0].score
    given = ", ".join(_given(environment, steps) for environment, steps in budgets.items())
    said = (
        f"Seeds {', '.join(map(str, entries[0].seeds))}; environment steps per seed: {given}. Brackets are "
        "95 % intervals over seeds: Student's t for means and for differences, which are paired by seed, the "
        "stratified bootstrap for interquartile means and for the probability that a seed of the method ends "
        f"with more {score.word} than one of the method it is compared with"
        + (", and nowhere narrower than what the episodes leave open" if score.bounded else "")
        + ". The area is the mean height of the learning curve"
        f"{_horizons(budgets, score)}."
    )
    return [said + (REACHING if score.thresholds else "")]


def _horizons(budgets: Mapping[str, Mapping[str, int]], score: Score) -> str:
    """How far areas reach, where a method was given fewer steps than another."""
    common = ", ".join(
        f"{min(steps.values()) / 1e6:g} M in {environment}"
        for environment, steps in budgets.items()
        if len(set(steps.values())) > 1
    )
    if not common:
        return ""
    return (
        f" up to the smallest budget where budgets differ ({common}); final {score.word} is at the end of a "
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


def _differences(entries: Sequence[Entry], reference: str) -> list[str]:
    """By how much the reference method is above each other."""
    score = entries[0].score
    heading = [
        "environment",
        f"{reference} against",
        f"difference of final {score.word}",
        "difference of area",
    ]
    lines = ["| " + " | ".join(heading) + " |", "|" + len(heading) * "---|"]
    for entry in entries:
        against = _beside(entries, entry, reference)
        if against:
            cells = [entry.environment, entry.method, *_difference(against, entry)]
            lines.append("| " + " | ".join(cells) + " |")
    return lines


def _difference(ours: Entry, theirs: Entry) -> list[str]:
    """Of their final scores and of their areas, seed by seed where both have the same."""
    score, paired = ours.score, sorted(ours.seeds) == sorted(theirs.seeds)
    one, other = np.argsort(ours.seeds), np.argsort(theirs.seeds)
    episodes = min(ours.episodes, theirs.episodes)
    final = score.difference(ours.final[one], theirs.final[other], paired, episodes)
    area = score.difference(ours.area[one], theirs.area[other], paired)
    return [score.range(final, signed=True), score.range(area, signed=True)]


def _over_all(entries: Sequence[Entry], reference: str) -> list[str]:
    """The methods over all environments together; returns of several have no mean in common."""
    score = entries[0].score
    middle = [f"interquartile mean of final {score.word}"] if score.bounded else []
    heading = ["all environments", *middle, f"better than {reference}"]
    lines = ["| " + " | ".join(heading) + " |", "|" + len(heading) * "---|"]
    environments = len({entry.environment for entry in entries})
    for method in dict.fromkeys(entry.method for entry in entries):
        mine = [entry for entry in entries if entry.method == method]
        pairs = [(entry, against) for entry in mine if (against := _beside(entries, entry, reference))]
        cells = [method if len(mine) == environments else f"{method} (in {len(mine)} of {environments})"]
        if score.bounded:
            cells.append(score.range(_middle(mine)))
        cells.append(SUCCESS.range(_improvement(*zip(*pairs, strict=True))) if pairs else "")
        lines.append("| " + " | ".join(cells) + " |")
    return lines


def _middle(entries: Sequence[Entry]) -> Interval:
    """Of one method's final scores, over environments and seeds."""
    episodes = min(entry.episodes for entry in entries) if entries[0].score.bounded else None
    return interquartile_interval(np.stack([entry.final for entry in entries]), episodes=episodes)


def _improvement(entries: Sequence[Entry], others: Sequence[Entry]) -> Interval:
    return probability_of_improvement(
        np.stack([entry.final for entry in entries]), np.stack([entry.final for entry in others])
    )


def _beside(entries: Sequence[Entry], entry: Entry, reference: str) -> Entry | None:
    """The reference method where another one was run; None if it was not, or is that method itself."""
    same = (other for other in entries if other.environment == entry.environment)
    return next((other for other in same if other.method == reference and other is not entry), None)


def _steps(reached: Sequence[Reaching]) -> str:
    mean, count = restricted_mean(reached)
    # What is bounded from below is rounded down.
    if count < len(reached):
        return f"> {np.floor(mean / 1e4) / 100:.2f} M ({count} of {len(reached)} seeds)"
    return f"{mean / 1e6:.2f} M"


def _write_csv(path: Path, entries: Sequence[Entry]) -> None:
    score = entries[0].score
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        steps_columns = [STEPS_COLUMNS[threshold] for threshold in score.thresholds]
        writer.writerow(("environment", "method", "seed", "steps", score.word, "area", *steps_columns))
        for entry in entries:
            for index, seed in enumerate(entry.seeds):
                reached = [entry.steps_to[threshold][index] for threshold in score.thresholds]
                values = [float(entry.final[index]), float(entry.area[index])]
                values += [one.steps if one.held else math.nan for one in reached]
                writer.writerow((entry.environment, entry.method, seed, entry.steps, *values))
