"""Episodes of the made-up world, for pictures and films."""

import functools

from analysis.page import meadow
from skillcrew.analysis.film.episode import Episode, episode_of


@functools.cache
def failed() -> Episode:
    """One that lasts all its steps."""
    return episode_of(meadow.a_run(meadow.Meadow()), 11, "failed")
