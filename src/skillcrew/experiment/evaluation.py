"""What champions reached on fresh episodes."""

import dataclasses
import math
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from skillcrew.errors import UserError
from skillcrew.experiment.score import RETURN, SUCCESS, Score
from skillcrew.intervals import Interval


@dataclasses.dataclass(frozen=True)
class Evaluation:
    """Champions' scores on fresh episodes, one champion per seed.

    They are scored by success where the environment says what that is, else by their return.
    """

    seeds: tuple[int, ...]
    episodes: int
    """Per seed."""
    returns: Float[np.ndarray, "seeds episodes"]
    """Team return of each episode."""
    choices: Int[np.ndarray, "seeds episodes time agents"]
    """Index of the chosen skill at each step, -1 after an episode's end."""
    completed: Bool[np.ndarray, "seeds episodes"] | None = None
    """Whether each episode ended with success; None if the environment does not say what that is."""

    @property
    def score(self) -> Score:
        """What champions are compared by."""
        return RETURN if self.completed is None else SUCCESS

    @property
    def per_seed(self) -> list[Interval]:
        """Each seed's mean score with its 95 % interval over episodes; see `Score.over_episodes`."""
        return self._per_seed(self.score)

    @property
    def overall(self) -> Interval:
        """The mean score with its 95 % interval over seeds (over episodes, if there is one seed).

        Over seeds it is never narrower than what their episodes leave open; see `seed_interval`.
        """
        return self._overall(self.score)

    @property
    def success_rate(self) -> Interval:
        """The share of episodes that ended with success, as `overall`.

        Raises:
            UserError: the environment does not say what success is.
        """
        if self.completed is None:
            raise UserError(
                "success_rate: the environment does not say what success is (Environment.success); see "
                "team_return"
            )
        return self._overall(SUCCESS)

    @property
    def team_return(self) -> Interval:
        """The mean team return, as `overall`."""
        return self._overall(RETURN)

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers, for JSON; None for the ends of an interval that is not known."""
        scores = [self.score] if self.score is RETURN else [SUCCESS, RETURN]
        return {**{score.key: self._numbers(score) for score in scores}, "episodes": self.episodes}

    def _numbers(self, score: Score) -> dict[str, Any]:
        seeds = zip(self.seeds, self._per_seed(score), strict=True)
        per_seed = [{"seed": seed, **_plain(interval)} for seed, interval in seeds]
        return {**_plain(self._overall(score)), "per_seed": per_seed}

    def _values(self, score: Score) -> Float[np.ndarray, "seeds episodes"]:
        return self.returns if score is RETURN else np.asarray(self.completed, float)

    def _per_seed(self, score: Score) -> list[Interval]:
        return [score.over_episodes(row) for row in self._values(score)]

    def _overall(self, score: Score) -> Interval:
        if len(self.seeds) == 1:
            return self._per_seed(score)[0]
        return score.over_seeds(self._values(score).mean(1), self.episodes)


def _plain(interval: Interval) -> dict[str, float | None]:
    numbers = dataclasses.asdict(interval)
    return {name: None if math.isnan(value) else value for name, value in numbers.items()}
