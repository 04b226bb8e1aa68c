"""`skillcrew evaluate RUN`."""

import dataclasses
import json

from skillcrew.cli.options import parse_options
from skillcrew.cli.present import describe_evaluation, take_places
from skillcrew.experiment.run import Run

USAGE = (
    "usage: skillcrew evaluate RUN [OPTIONS]\n\n"
    "RUN  the folder of a run\n\n"
    "Plays each seed's champion on fresh episodes that no selection ever saw, without exploration noise."
)


@dataclasses.dataclass(frozen=True)
class EvaluateOptions:
    """Options of `skillcrew evaluate`."""

    episodes: int = 1000
    """Episodes per seed."""
    checkpoint: int | None = None
    """Generation whose champions are scored. Default: the latest checkpoint."""
    trust: bool = False
    """Import the environment's class from wherever the folder says: that runs its code."""
    json: bool = False
    """Print one JSON object and nothing else."""


def run(words: list[str]) -> int:
    """Prints each seed's score and the mean over seeds, with 95 % intervals."""
    places = take_places(words, ("RUN",), USAGE)
    if places is None:
        parse_options(EvaluateOptions, ["--help"], EvaluateOptions(), ("evaluate", "RUN"), USAGE)
        return 0
    options = parse_options(EvaluateOptions, words[1:], EvaluateOptions(), ("evaluate", words[0]), USAGE)
    evaluation = Run(places[0], checkpoint=options.checkpoint, trust=options.trust).evaluate(options.episodes)
    if options.json:
        print(json.dumps({**evaluation.as_dict(), "run": places[0]}, indent=1))
    else:
        print(describe_evaluation(evaluation))
    return 0
