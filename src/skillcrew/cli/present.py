"""What several commands print, and how they take their places on the command line."""

import math
from collections.abc import Sequence

from skillcrew.errors import UserError
from skillcrew.experiment.run import Evaluation
from skillcrew.intervals import Interval


def take_places(words: Sequence[str], places: tuple[str, ...], usage: str) -> list[str] | None:
    """The words that must come first, or None where `--help` is asked for instead.

    Raises:
        UserError: one is missing.
    """
    given = []
    for place, word in zip(places, [*words, *[None] * len(places)], strict=False):
        if word in ("-h", "--help"):
            return None
        if word is None or word.startswith("-"):
            raise UserError(f"{place} is missing; {usage.splitlines()[0]}")
        given.append(word)
    return given


def describe_evaluation(evaluation: Evaluation) -> str:
    """Each seed's success rate and the mean, as lines."""
    lines = [
        f"seed {seed:<6} {interval.mean:.3f} {_range(interval)}"
        for seed, interval in zip(evaluation.seeds, evaluation.per_seed, strict=True)
    ]
    total = evaluation.success_rate
    lines.append(
        f"success     {total.mean:.3f} {_range(total)} on {evaluation.episodes} fresh episodes per seed"
    )
    return "\n".join(lines)


def _range(interval: Interval) -> str:
    return "" if math.isnan(interval.low) else f"[{interval.low:.3f}, {interval.high:.3f}]"
