"""`skillcrew resume RUN`."""

import dataclasses
from typing import Literal

from skillcrew.cli.arguments import TrackerNames
from skillcrew.cli.conclusion import run_and_report
from skillcrew.cli.options import parse_options
from skillcrew.cli.present import take_places
from skillcrew.experiment.config import OF_SESSION
from skillcrew.experiment.progress import make_reporter
from skillcrew.experiment.run import Run
from skillcrew.experiment.trackers.tracking import Tracking

USAGE = (
    "usage: skillcrew resume RUN [OPTIONS]\n\n"
    "RUN  the folder of a run that was interrupted, or one to train beyond its budget (--steps)\n\n"
    "Goes on from the latest checkpoint and ends in the same bits as if it had never been interrupted."
)


@dataclasses.dataclass(frozen=True)
class ResumeOptions:
    """Options of `skillcrew resume`."""

    steps: int | None = None
    """A larger budget of environment steps per seed. Default: the run's own."""
    checkpoint: int | None = None
    """Generation to go on from. Default: the latest checkpoint."""
    max_seconds: float | None = None
    """Seconds after which it saves and stops as on Ctrl-C, compiling not counted. Default: the run's own."""
    warning_signal: str | None = None
    """A further signal on which it saves and stops, such as USR1. Default: the run's own."""
    on_bad_numbers: Literal["stop", "roll-back"] | None = None
    """What happens where a number is not finite; see `skillcrew train`. Default: the run's own."""
    trackers: TrackerNames | None = None
    """Who keeps a record, or none, from now on; earlier rows are added. Default: the run's own."""
    trust: bool = False
    """Import the environment's class from wherever the folder says: that runs its code."""
    report_episodes: int = 1000
    """Fresh episodes of the final score and of the report."""
    quiet: bool = False
    """No progress: the final score and errors alone."""


def run(words: list[str]) -> int:
    """Resumes, then writes and announces the report; 130 if interrupted again."""
    places = take_places(words, ("RUN",), USAGE)
    if places is None:
        parse_options(ResumeOptions, ["--help"], ResumeOptions(), ("resume", "RUN"), USAGE)
        return 0
    options = parse_options(ResumeOptions, words[1:], ResumeOptions(), ("resume", words[0]), USAGE)
    unfinished = Run(places[0], checkpoint=options.checkpoint, trust=options.trust)
    budget = options.steps or unfinished.config.steps
    reporter = make_reporter(budget, unfinished.config.seeds, quiet=options.quiet)
    given = {name: getattr(options, name) for name in OF_SESSION}
    session = {name: value for name, value in given.items() if value is not None}
    names = session.get("trackers", unfinished.config.trackers)
    return run_and_report(
        lambda tracking: unfinished.resume(options.steps, reporter, tracking, **session),
        reporter,
        lambda: Tracking(names, reporter.note, required="trackers" in session),
        places[0],
        options.report_episodes,
    )
