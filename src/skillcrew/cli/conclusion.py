"""How `train` and `resume` end: saved on Ctrl-C, or scored and reported."""

import contextlib
import sys
from collections.abc import Callable

from skillcrew.analysis.report import write_report
from skillcrew.cli.present import describe_evaluation
from skillcrew.errors import UserError
from skillcrew.experiment.config import MOST_AT_ONCE
from skillcrew.experiment.progress import Reporter
from skillcrew.experiment.run import Run
from skillcrew.experiment.runner import Interrupted


def run_and_report(go: Callable[[], Run], reporter: Reporter, folder: str, episodes: int) -> int:
    """Runs to the end of the budget, scores the champions on fresh episodes, and draws the report.

    Returns:
        The exit code: 0, or 130 if the run was interrupted after saving.
    """
    if not 1 <= episodes <= MOST_AT_ONCE:
        raise UserError(f"report_episodes = {episodes}: give a number from 1 to {MOST_AT_ONCE}")
    try:
        finished = go()
    except Interrupted:
        finished = None
    finally:
        reporter.close()
    if finished is None:
        # There is no terminal any more where its hanging up was the reason.
        with contextlib.suppress(OSError):
            print(f"Interrupted and saved. `skillcrew resume {folder}` goes on.", file=sys.stderr)
        return 130
    evaluation = finished.evaluate(episodes)
    print(describe_evaluation(evaluation))
    for line in finished.config.origins():
        print(line[0].upper() + line[1:])
    written = write_report(finished, evaluation)
    print(f"Report: {written[0]} and {len(written) - 1} more in {finished.folder.report}")
    return 0
