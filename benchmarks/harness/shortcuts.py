"""What commands leave out under harnesses that only ask how they take their input."""

import contextlib
from collections.abc import Generator
from typing import Any
from unittest import mock

import numpy as np
from benchmarks.harness.damages import no_drawing
from benchmarks.harness.sharing import shared_programs

from skillcrew.experiment.evaluation import Evaluation


def done(*_: Any, **__: Any) -> None:
    """Stands in for work that is left out."""
    raise SystemExit(0)


@contextlib.contextmanager
def no_checkpoints() -> Generator[None]:
    """Ends a command with exit code 0 where it would read a checkpoint."""
    with (
        mock.patch("skillcrew.experiment.runner.Runner.restore", done),
        mock.patch("skillcrew.experiment.runner.Runner.champions", done),
    ):
        yield


@contextlib.contextmanager
def no_training() -> Generator[None]:
    """Ends a command with exit code 0 where it would begin to train or to check a world; draws nothing."""

    def evaluate(run: Any, episodes: int = 1000) -> Evaluation:
        run.champions()
        count, steps = len(run.config.seeds), 3
        choices = np.zeros((count, 5, steps, run.algorithm.env.n_agents), int)
        return Evaluation(run.config.seeds, 5, np.zeros((count, 5)), choices, np.zeros((count, 5), bool))

    with contextlib.ExitStack() as stack:
        stack.enter_context(shared_programs())
        stack.enter_context(no_drawing())
        for place in (
            "skillcrew.experiment.runner.Runner.start",
            "skillcrew.experiment.runner.Runner.run",
            "skillcrew.cli.check.check_environment",
            "skillcrew.cli.side_by_side._train",
        ):
            stack.enter_context(mock.patch(place, done))
        stack.enter_context(mock.patch("skillcrew.experiment.run.Run.evaluate", evaluate))
        stack.enter_context(mock.patch("skillcrew.analysis.report.shown_episodes", lambda *_: []))
        stack.enter_context(mock.patch("skillcrew.experiment.folder.describe_environment", lambda: ""))
        for place in ("skillcrew.experiment.memory.estimate", "skillcrew.cli.side_by_side.estimate"):
            stack.enter_context(mock.patch(place, lambda *_: 1))
        yield
