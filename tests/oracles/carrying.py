"""Hands on loads once more, agent by agent in NumPy, and how close a decision was to falling otherwise."""

import math

import numpy as np


class Decisions:
    """Compares, and keeps the smallest difference that a comparison hung on, in metres."""

    def __init__(self):
        self.gap = math.inf

    def within(self, distance: float, limit: float) -> bool:
        self.gap = min(self.gap, abs(distance - limit))
        return distance <= limit

    def first_nearest(self, distances: dict[int, float]) -> int | None:
        """The key of the smallest distance, the first of those that are alike; None of none."""
        if not distances:
            return None
        best = min(distances, key=lambda key: (distances[key], key))
        for key, distance in distances.items():
            # Two things at the very same place are as near in any arithmetic.
            if key != best and distance != distances[best]:
                self.gap = min(self.gap, distance - distances[best])
        return best


def far(here: np.ndarray, there: np.ndarray) -> float:
    return math.hypot(there[0] - here[0], there[1] - here[1])


def driven(action: np.ndarray, speed: float) -> np.ndarray:
    cut = np.array([min(1.0, max(-1.0, entry)) for entry in action])
    return speed * cut / max(1.0, math.hypot(*cut))


def carry(loads: np.ndarray, held: np.ndarray, moved: np.ndarray, coupling: int, hands=None) -> np.ndarray:
    """Where loads are after their bearers moved.

    Args:
        hands: how many of each agent there are; one each by default.
    """
    hands = [1] * len(moved) if hands is None else hands
    loads = loads.copy()
    for load in range(len(loads)):
        bearers = [agent for agent in range(len(moved)) if held[load, agent]]
        count = sum(hands[agent] for agent in bearers)
        if count >= coupling:
            loads[load] += sum(hands[agent] * moved[agent] for agent in bearers) / count
    return loads


def let_go(by: Decisions, position, loads, held, reach: float, coupling: int, hands=None) -> np.ndarray:
    hands = [1] * len(position) if hands is None else hands
    kept = np.zeros_like(held)
    for load in range(len(loads)):
        near = [
            agent
            for agent in range(len(position))
            if held[load, agent] and by.within(far(position[agent], loads[load]), reach)
        ]
        if sum(hands[agent] for agent in near) >= coupling:
            kept[load, near] = True
    return kept


def lift(by: Decisions, position, loads, held, available, reach: float, coupling: int) -> np.ndarray:
    lying = [load for load in range(len(loads)) if available[load] and not held[load].any()]
    hands_on: dict[int, list[int]] = {load: [] for load in lying}
    for agent in range(len(position)):
        if held[:, agent].any():
            continue
        distances = {load: far(position[agent], loads[load]) for load in lying}
        within = {load: distance for load, distance in distances.items() if by.within(distance, reach)}
        nearest = by.first_nearest(within)
        if nearest is not None:
            hands_on[nearest].append(agent)
    held = held.copy()
    for load, agents in hands_on.items():
        if len(agents) >= coupling:
            held[load, agents] = True
    return held
