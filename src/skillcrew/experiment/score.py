"""What teams are scored by: success where an environment says what that is, else the return."""

import dataclasses
import math
from collections.abc import Mapping

import numpy as np
from jaxtyping import Array, Float

from skillcrew.envs.environment import Environment
from skillcrew.intervals import Interval, difference_interval, proportion_interval, seed_interval
from skillcrew.rollout import Episodes


@dataclasses.dataclass(frozen=True)
class Score:
    """A figure by which teams are compared; all that shows it asks this for names, range and intervals."""

    key: str
    """Its column among the metrics, and its name in JSON."""
    word: str
    """What lines of text call it."""
    label: str
    """What axes and tables call it."""
    lower: float = -math.inf
    upper: float = math.inf
    thresholds: tuple[float, ...] = ()
    """Values that are worth saying when they were reached."""
    start: float | None = None
    """What a learning curve begins with; None for its first value."""
    decimals: int | None = None
    """Digits behind the point; None for four digits in all, wherever the point is."""

    @property
    def bounded(self) -> bool:
        """Whether all environments share its scale, so that they may share an axis and a mean."""
        return math.isfinite(self.lower) and math.isfinite(self.upper)

    def over_episodes(self, values: Float[np.ndarray, " episodes"]) -> Interval:
        """One team's mean with its 95 % interval: Wilson's where a value is 0 or 1, else Student's t."""
        if self.bounded:
            return proportion_interval(int(values.sum()), len(values))
        return self.over_seeds(values)

    def over_seeds(self, values: Float[np.ndarray, " seeds"], episodes: int | None = None) -> Interval:
        """The mean with its 95 % interval over seeds, within the range; see `seed_interval`.

        Args:
            episodes: of each seed, if its value is the mean score of them.
        """
        return seed_interval(values, self.lower, self.upper, episodes if self.bounded else None)

    def difference(
        self,
        ours: Float[np.ndarray, " seeds"],
        theirs: Float[np.ndarray, " others"],
        paired: bool,
        episodes: int | None = None,
    ) -> Interval:
        """By how much one mean is above another, with its 95 % interval; see `difference_interval`."""
        return difference_interval(ours, theirs, paired, episodes if self.bounded else None)

    def number(self, value: float, decimals: int | None = None) -> str:
        """A value as people read it.

        Args:
            decimals: for a figure that has a fixed number of them; by default its own.
        """
        if self.decimals is not None:
            return f"{value:.{self.decimals if decimals is None else decimals}f}"
        return f"{value:.0f}" if 1e4 <= abs(value) < 1e15 else f"{value:.4g}"

    def range(self, interval: Interval, decimals: int | None = None, signed: bool = False) -> str:
        """`0.500 [0.400, 0.600]`, or the mean alone where nothing is known of its spread.

        Args:
            signed: for a difference, `+0.500 [+0.400, +0.600]`.
        """

        def number(value: float) -> str:
            return ("-" if value < 0 else "+" if signed else "") + self.number(abs(value), decimals)

        if math.isnan(interval.low):
            return number(interval.mean)
        return f"{number(interval.mean)} [{number(interval.low)}, {number(interval.high)}]"


SUCCESS = Score("success_rate", "success", "success rate", 0.0, 1.0, (0.5, 0.9), 0.0, 3)
"""The share of episodes that end terminated."""

RETURN = Score("team_return", "return", "team return")
"""The mean sum of an episode's team rewards."""


def score_of(env: Environment) -> Score:
    """What teams are scored by in an environment."""
    return RETURN if env.success is None else SUCCESS


def score_among(columns: Mapping[str, object]) -> Score:
    """What metrics were scored by."""
    return SUCCESS if SUCCESS.key in columns else RETURN


def measured(env: Environment, episodes: Episodes) -> dict[str, Array]:
    """The scores of a team that lived some episodes: its mean return, and success where that is defined."""
    scores = {RETURN.key: episodes.team_return().mean()}
    if env.success is not None:
        scores = {SUCCESS.key: episodes.completed().mean(), **scores}
    return scores
