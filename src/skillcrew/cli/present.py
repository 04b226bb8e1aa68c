"""What several commands print, and how they take their places on the command line."""

from collections.abc import Sequence

from skillcrew.errors import UserError
from skillcrew.experiment.evaluation import Evaluation
from skillcrew.experiment.score import RETURN


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
    """Each seed's score and the mean, as lines; and the return, where success does not say the same."""
    score = evaluation.score
    lines = [
        f"seed {seed:<6} {score.range(interval)}"
        for seed, interval in zip(evaluation.seeds, evaluation.per_seed, strict=True)
    ]
    on = f"on {evaluation.episodes} fresh episodes per seed"
    lines.append(f"{score.word:<11} {score.range(evaluation.overall)} {on}")
    if evaluation.completed is not None and (evaluation.returns != evaluation.completed).any():
        lines.append(f"{RETURN.word:<11} {RETURN.range(evaluation.team_return)} {on}")
    return "\n".join(lines)
