"""The page of `evorl.py`."""

import dataclasses
import statistics
from collections.abc import Callable
from typing import Any

from benchmarks import machine
from benchmarks.evorl_race import TIME_LIMIT, Settings

GOOD = -200.0
"""A mean return from which on the pendulum is swung up and held nearly every time."""

Runs = dict[str, list[dict[str, Any]]]
"""The runs of each side, by seed; ours first."""

PAGE = """\
# ERL beside EvoRL's on Pendulum-v1

- Machine: {machine}; both sides pinned to the same single core, one at a time.
- Software: {software}.
- {seeds} seeds of {budget:,} environment steps ({limit} to an episode) a side, alternating. Shown are means
  (minimum to maximum) over seeds; ratios are medians of those seed by seed.
- Returns are mean sums of rewards over {evaluation} fresh episodes without noise, {marks} times in a run.
  They count neither as steps nor as seconds.
- The same pendulum: {parity_steps:,} steps of random episodes of theirs, replayed in ours, differ by at most
  {observation:.1g} in an observation and {reward:.1g} in a reward, and end at the same steps.

{summary}

{ratios}

Mean return over the seeds, by environment steps:

{curve}

{seconds}

Settings that both have: {settings}.

What could not be made equal:

{unequal}

Written by `python -m benchmarks.evorl`; [the notes](../README.md) say what is compared.
"""

UNEQUAL = """\
- A generation. Ours also lives the learner's episodes without noise, so that it has a fitness of its own
  before it migrates; theirs migrates unevaluated. Steps and updates for each step being equal, theirs has
  more generations.
- When the learner migrates: ours before this generation's updates, ranked at once with the others; theirs
  after them, past selection.
- Ranking: ours by averages over a lineage's evaluations, and its champion by surer ones still; theirs by
  the last evaluation alone. All of our population meet the same start states; each of theirs its own.
  EvoRL evaluates its learner alone, and names nobody in its population the one to use.
- Mutation: ours changes a child with one probability, its weights and biases alike; theirs decides for each
  weight matrix and leaves biases as they are.
- Initial weights: ours normal, theirs uniform.
- Of EvoRL's kinds of ERL this is `erl/erl-ga`, whose generation is one compiled program. It is called as in
  its own `learn`, without records; ours is compiled as by `skillcrew train`, but one generation at a time.
- EvoRL takes the time limit for the end of the task where gymnax's pendulum says so, and does not bootstrap
  from there. Our pendulum says the same here, so that both learn the same task."""


def spread(values: list[float], form: str = ",.0f") -> str:
    """Mean, and minimum to maximum."""
    low, middle, high = (format(f(values), form) for f in (min, statistics.mean, max))
    text = middle if low == high else f"{middle} ({low} to {high})"
    return text.replace("inf", "never")


def last(who: str) -> Callable[[dict[str, Any]], float]:
    return lambda run: run["curve"][-1][who]


def over_curve(who: str) -> Callable[[dict[str, Any]], float]:
    return lambda run: statistics.mean(row[who] for row in run["curve"])


def steps_to_good(run: dict[str, Any]) -> float:
    """Environment steps at the first point of the learner's curve that is good; infinite if none is."""
    return min((row["steps"] for row in run["curve"] if row["learner"] >= GOOD), default=float("inf"))


ROWS: dict[str, Callable[[dict[str, Any]], float]] = {
    "return at the end, the population's best": last("population"),
    "return at the end, the learner": last("learner"),
    "mean return over the run, the population's best": over_curve("population"),
    "mean return over the run, the learner": over_curve("learner"),
    f"environment steps until the learner first has {GOOD:.0f}": steps_to_good,
    "environment steps": last("steps"),
    "generations": lambda run: run["generations"],
    "seconds of a run, elapsed": lambda run: run["wall"],
    "seconds of a run, of the processor": lambda run: run["processor"],
}


SECONDS = {"processor": "of the processor", "wall": "elapsed"}


def summary(ready: dict[str, Any], runs: Runs) -> str:
    """One row per measure, one column per side."""
    lines = ["| | " + " | ".join(runs) + " |", "|---" * (1 + len(runs)) + "|"]
    for title, measure in ROWS.items():
        cells = [spread([measure(run) for run in of_side]) for of_side in runs.values()]
        lines.append(f"| {title} | " + " | ".join(cells) + " |")
    for measure, word in SECONDS.items():
        cells = [f"{ready[side][measure]:.0f}" for side in runs]
        lines.append(
            f"| seconds before all runs, {word}: a first state, compiling | " + " | ".join(cells) + " |"
        )
    return "\n".join(lines)


def ratios(ready: dict[str, Any], runs: Runs) -> str:
    """Time as ratios, and returns as differences, of the same seeds."""
    (ours, mine), (theirs, other) = runs.items()
    lines = []
    for measure, word in SECONDS.items():
        apart = [b[measure] / a[measure] for a, b in zip(mine, other, strict=True)]
        low, middle, high = min(apart), statistics.median(apart), max(apart)
        before = ready[theirs][measure] / ready[ours][measure]
        lines.append(
            f"- {theirs} took {middle:.2f} ({low:.2f} to {high:.2f}) times {ours}'s seconds {word}, and "
            f"{before:.1f} times before it could run."
        )
    for title in list(ROWS)[:4]:
        values = [[ROWS[title](run) for run in of_side] for of_side in (mine, other)]
        higher = sum(a > b for a, b in zip(*values, strict=True))
        apart = statistics.mean(values[0]) - statistics.mean(values[1])
        lines.append(
            f"- {title[0].upper()}{title[1:]}: {ours}'s is {abs(apart):.0f} "
            f"{'higher' if apart > 0 else 'lower'}, and the higher in {higher} of {len(mine)} seeds."
        )
    return "\n".join(lines)


def curve(runs: Runs) -> str:
    """Mean returns over seeds, a row for each point of the curve."""
    columns = [(side, who) for who in ("population", "learner") for side in runs]
    titles = {"population": "population's best", "learner": "learner"}
    head = " | ".join(f"{side}, {titles[who]}" for side, who in columns)
    lines = [f"| share of the budget | {head} |", "|---" * (1 + len(columns)) + "|"]
    points = len(next(iter(runs.values()))[0]["curve"])
    for index in range(points):
        cells = [
            f"{statistics.mean(run['curve'][index][who] for run in runs[side]):,.0f}" for side, who in columns
        ]
        lines.append(f"| {(index + 1) / points:.0%} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def share_of_core(runs: Runs) -> str:
    """What other programs took."""
    shares = [run["processor"] / run["wall"] for of_side in runs.values() for run in of_side]
    return (
        "Seconds of the processor leave out what other programs took of the core: the runs had "
        f"{min(shares):.0%} to {max(shares):.0%} of it."
    )


def page(settings: Settings, ready: dict[str, Any], runs: Runs, parity: dict[str, Any]) -> str:
    """The whole result as Markdown."""
    software = "; ".join(
        f"{side} with " + ", ".join(f"{name} {number}" for name, number in ready[side]["versions"].items())
        for side in runs
    )
    values = dataclasses.asdict(settings).items()
    unlisted = ("budget", "marks", "evaluation_episodes")
    listed = ", ".join(f"{name.replace('_', ' ')} {value}" for name, value in values if name not in unlisted)
    return PAGE.format(
        machine=machine.cpu_model(),
        software=f"{machine.software({})}; {software}",
        seeds=len(next(iter(runs.values()))),
        budget=settings.budget,
        limit=TIME_LIMIT,
        evaluation=settings.evaluation_episodes,
        marks=settings.marks,
        parity_steps=parity["steps"],
        observation=parity["observation"],
        reward=parity["reward"],
        summary=summary(ready, runs),
        ratios=ratios(ready, runs),
        curve=curve(runs),
        seconds=share_of_core(runs),
        settings=listed,
        unequal=UNEQUAL,
    )
