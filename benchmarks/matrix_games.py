"""Repeated matrix games of two agents, which both get what the two choices pay (Claus and Boutilier 1998).

What is safe alone pays little together: an agent that explores alone is punished, and the best pair of
choices is the one that is hardest to come to. Nothing is seen.
"""

from collections.abc import Mapping

LENGTH = 25
"""Rounds of an episode, as in Papoudakis et al. 2021."""

Payoff = tuple[tuple[int, ...], ...]
"""By the first agent's choice and the second's."""


def penalty(k: int) -> Payoff:
    """Two best pairs, 10 each; who aims at the other one than its teammate costs k."""
    return ((k, 0, 10), (0, 2, 0), (10, 0, k))


GAMES: Mapping[str, Payoff] = {
    "climbing": ((11, -30, 0), (-30, 7, 0), (0, 6, 5)),
    "penalty-0": penalty(0),
    "penalty-25": penalty(-25),
    "penalty-100": penalty(-100),
}


def best(game: str) -> int:
    """The most that an episode can return."""
    return LENGTH * max(map(max, GAMES[game]))


def by_chance(game: str) -> float:
    """What an episode returns, on average, to agents that choose evenly."""
    payoff = GAMES[game]
    return LENGTH * sum(map(sum, payoff)) / sum(map(len, payoff))
