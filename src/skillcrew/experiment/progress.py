"""What a person sees while a run works: a live table in a terminal, plain lines elsewhere."""

import time
from collections.abc import Iterable, Iterator, Mapping
from typing import Protocol, TypeVar, runtime_checkable

import numpy as np
from rich.console import Console, Group
from rich.live import Live
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, track
from rich.table import Table

from skillcrew.errors import one_line
from skillcrew.experiment.score import score_among

LINE_SECONDS = 10.0
"""Least time between two lines where the output is no terminal."""


@runtime_checkable
class Reporter(Protocol):
    """Told what happens; decides what to show."""

    def note(self, line: str) -> None:
        """Something worth a line of its own."""
        ...

    def update(self, metrics: Mapping[str, np.ndarray], steps_per_second: float) -> None:
        """After a chunk of generations; metrics have axes [seeds, generations]."""
        ...

    def close(self) -> None:
        """The run is over, or interrupted."""
        ...


def make_reporter(
    budget: int, seeds: tuple[int, ...], console: Console | None = None, quiet: bool = False
) -> Reporter:
    """A live display in a terminal, lines elsewhere, both on standard error; nothing where `quiet`."""
    if quiet:
        return SilentReporter()
    console = console or Console(stderr=True)
    return LiveReporter(console, budget, seeds) if console.is_terminal else LineReporter(console, budget)


class SilentReporter:
    """Shows nothing: for use as a library."""

    def note(self, line: str) -> None: ...

    def update(self, metrics: Mapping[str, np.ndarray], steps_per_second: float) -> None: ...

    def close(self) -> None: ...


class Summary:
    """The numbers of one report, from a chunk's metrics [seeds, generations]."""

    def __init__(self, metrics: Mapping[str, np.ndarray], budget: int, steps_per_second: float):
        steps = np.asarray(metrics["environment_steps"])[:, -1]
        self.generation = int(np.asarray(metrics["generation"]).max())
        self.steps = int(min(steps.min(), budget))
        self.score = score_among(metrics)
        self.score_by_seed = np.asarray(metrics[self.score.key]).mean(1)
        self.best = float(np.asarray(metrics["fitness_best"])[:, -1].mean())
        self.mean = float(np.asarray(metrics["fitness_mean"])[:, -1].mean())
        self.returns = {
            name.removeprefix("return_"): float(np.asarray(values).mean())
            for name, values in metrics.items()
            if name.startswith("return_")
        }
        self.stopped = {
            name.removeprefix("stopped_at_"): int((np.asarray(values)[:, -1] >= 0).sum())
            for name, values in metrics.items()
            if name.startswith("stopped_at_")
        }
        self.steps_per_second = steps_per_second
        left = max(0.0, budget - float(steps.min()))
        self.seconds_left = left * len(steps) / steps_per_second if steps_per_second else float("inf")

    def champion(self) -> str:
        """The champion's score, mean over seeds with its 95 % interval."""
        return self.score.range(self.score.over_seeds(self.score_by_seed), decimals=2)

    def number(self, value: float) -> str:
        """A score or a fitness, which is on the same scale."""
        return self.score.number(value, decimals=2)


class Arrived:
    """Seeds that reached the budget before the slowest one: they live on, unscored."""

    def __init__(self, budget: int):
        self._budget = budget
        self._last: dict[int, dict[str, np.ndarray]] = {}

    def standing(self, metrics: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """A chunk's metrics [seeds, generations] in which such seeds are as they were within the budget.

        How far they are is told as it is.
        """
        shown = {name: np.array(values) for name, values in metrics.items()}
        for seed, steps in enumerate(shown["environment_steps"]):
            if steps[0] <= self._budget:
                self._last[seed] = {name: values[seed, -1] for name, values in shown.items()}
                continue
            for name, value in self._last.get(seed, {}).items():
                if name not in ("environment_steps", "generation"):
                    shown[name][seed] = value
        return shown


class SkillsDone:
    """When skills stopped learning, remembered from one report to the next."""

    def __init__(self):
        self._steps: dict[int, float] = {}

    def said_after(self, metrics: Mapping[str, np.ndarray]) -> str:
        """A word on it after a chunk's metrics [seeds, generations]; empty while all skills learn.

        The environment steps are the slowest seed's, and left out where that stopped before the first report.
        """
        columns = [values for name, values in metrics.items() if name.startswith("stopped_at_")]
        if not columns:
            return ""
        stopped = np.stack([np.asarray(values)[:, -1] for values in columns])
        self._remember(metrics, stopped)
        done = int((stopped >= 0).sum())
        if done < stopped.size:
            return f"{done} of {stopped.size} skills done" if done else ""
        known = len(self._steps) == stopped.shape[1]
        return f"skills done at {human(max(self._steps.values()))}" if known else "skills done"

    def _remember(self, metrics: Mapping[str, np.ndarray], stopped: np.ndarray) -> None:
        generations = np.asarray(metrics["generation"])
        for seed in np.flatnonzero((stopped >= 0).all(0)):
            here = np.flatnonzero(generations[seed] == stopped[:, seed].max())
            if here.size:
                self._steps.setdefault(int(seed), float(metrics["environment_steps"][seed][here[0]]))


class LineReporter:
    """One line now and then, easy to keep in a log."""

    def __init__(self, console: Console, budget: int):
        self._console = console
        self._budget = budget
        self._arrived, self._skills = Arrived(budget), SkillsDone()
        self._last = -float("inf")

    def note(self, line: str) -> None:
        self._print(line)

    def update(self, metrics: Mapping[str, np.ndarray], steps_per_second: float) -> None:
        now = time.monotonic()
        metrics = self._arrived.standing(metrics)
        summary = Summary(metrics, self._budget, steps_per_second)
        done = self._skills.said_after(metrics)
        if now - self._last < LINE_SECONDS and summary.steps < self._budget:
            return
        self._last = now
        # Algorithms without skills have none.
        returns = " ".join(f"{name}={value:.2f}" for name, value in summary.returns.items())
        skills = (f"returns {returns}, " if returns else "") + (f"{done}, " if done else "")
        self._print(
            f"{human(summary.steps)} of {human(self._budget)} steps, "
            f"{summary.score.word} {summary.champion()}, "
            f"fitness best {summary.number(summary.best)} mean {summary.number(summary.mean)}, {skills}"
            f"{human(steps_per_second)} steps/s, {clock(summary.seconds_left)} left"
        )

    def close(self) -> None: ...

    def _print(self, line: str) -> None:
        self._console.print(one_line(line), soft_wrap=True, highlight=False, markup=False)


class LiveReporter:
    """A table that renews itself, with a bar and the time left."""

    def __init__(self, console: Console, budget: int, seeds: tuple[int, ...]):
        self._budget = budget
        self._seeds = seeds
        self._arrived, self._skills = Arrived(budget), SkillsDone()
        self._bar = Progress(
            TextColumn("{task.description}"), BarColumn(None), TaskProgressColumn(), expand=True
        )
        self._task = self._bar.add_task("compiling", total=budget)
        self._live = Live(self._bar, console=console, refresh_per_second=4)
        self._live.start()

    def note(self, line: str) -> None:
        self._live.console.print(one_line(line), highlight=False, markup=False)

    def update(self, metrics: Mapping[str, np.ndarray], steps_per_second: float) -> None:
        metrics = self._arrived.standing(metrics)
        summary = Summary(metrics, self._budget, steps_per_second)
        done = self._skills.said_after(metrics)
        label = (
            f"{human(summary.steps)} of {human(self._budget)} steps, {f'{done}, ' if done else ''}"
            f"{human(steps_per_second)} steps/s, {clock(summary.seconds_left)} left"
        )
        self._bar.update(self._task, completed=summary.steps, description=label)
        self._live.update(Group(self._table(summary), self._bar))

    def close(self) -> None:
        self._live.stop()

    def _table(self, summary: Summary) -> Table:
        table = Table(show_header=False, box=None, padding=(0, 2, 0, 0))
        scores = zip(self._seeds, summary.score_by_seed, strict=True)
        by_seed = "  ".join(f"{seed}: {summary.number(score)}" for seed, score in scores)
        table.add_row("generation", str(summary.generation))
        table.add_row(f"champion's {summary.score.label}", summary.champion())
        if len(self._seeds) > 1:
            table.add_row("by seed", by_seed)
        table.add_row("fitness", f"best {summary.number(summary.best)}, mean {summary.number(summary.mean)}")
        for skill, value in summary.returns.items():
            stopped = summary.stopped.get(skill, 0)
            note = f"  (training stopped in {stopped} of {len(self._seeds)} seeds)" if stopped else ""
            table.add_row(f"return of {skill}", f"{value:.2f}{note}")
        return table


Thing = TypeVar("Thing")


def tracked(
    things: Iterable[Thing], total: int, word: str, quiet: bool = False, console: Console | None = None
) -> Iterator[Thing]:
    """Passes things on, with a bar on standard error if that is a terminal; nothing where `quiet`."""
    console = console or Console(stderr=True)
    hidden = quiet or not console.is_terminal
    yield from track(things, word, total, console=console, disable=hidden, transient=True)


def human(number: float | int) -> str:
    """A count in k or M."""
    for size, unit in ((1e9, "G"), (1e6, "M"), (1e3, "k")):
        # What rounds up to 1000 of a unit belongs to the next one.
        if number >= 0.9995 * size:
            return f"{number / size:.3g} {unit}"
    return f"{number:.3g}"


def clock(seconds: float | int) -> str:
    """A duration as people read it."""
    if not np.isfinite(seconds):
        return "unknown time"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"
