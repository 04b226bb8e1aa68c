"""How `train` and `resume` end: saved on Ctrl-C, or scored and reported."""

import contextlib
import sys
from collections.abc import Callable

from skillcrew.analysis.report import seed_figures, write_report
from skillcrew.cli.present import describe_evaluation
from skillcrew.errors import UserError
from skillcrew.experiment.config import MOST_AT_ONCE
from skillcrew.experiment.progress import Reporter
from skillcrew.experiment.run import Run
from skillcrew.experiment.runner import Interrupted
from skillcrew.experiment.trackers.tracking import Tracking


def run_and_report(
    go: Callable[[Tracking], Run],
    reporter: Reporter,
    track: Callable[[], Tracking],
    folder: str,
    episodes: int,
) -> int:
    """Runs to the end of the budget, scores the champions on fresh episodes, and draws the report.

    Args:
        track: makes what keeps the records of the run, to the scores and the figures in the end.

    Returns:
        The exit code: 0, or 130 if the run was interrupted after saving.
    """
    with contextlib.ExitStack() as stack:
        with contextlib.closing(reporter):
            if not 1 <= episodes <= MOST_AT_ONCE:
                raise UserError(f"report_episodes = {episodes}: give a number from 1 to {MOST_AT_ONCE}")
            tracking = stack.enter_context(contextlib.closing(track()))
            try:
                finished = go(tracking)
            except Interrupted:
                finished = None
        if finished is None:
            # There is no terminal any more where its hanging up was the reason.
            with contextlib.suppress(OSError):
                print(f"Interrupted and saved. `skillcrew resume {folder}` goes on.", file=sys.stderr)
            return 130
        _conclude(finished, tracking, episodes)
    return 0


def _conclude(finished: Run, tracking: Tracking, episodes: int) -> None:
    evaluation = finished.evaluate(episodes)
    print(describe_evaluation(evaluation))
    for line in finished.config.origins():
        print(line[0].upper() + line[1:])
    written = write_report(finished, evaluation)
    print(f"Report: {written[0]} and {len(written) - 1} more in {finished.folder.report}")
    tracking.conclude(evaluation, finished.metrics, seed_figures(finished))
