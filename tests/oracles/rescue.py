"""Search and rescue once more: one world, one thing at a time, written from docs/environments/rescue.md."""

import dataclasses
import math
from typing import Any

import numpy as np

from oracles.carrying import Decisions, carry, driven, far, let_go, lift


@dataclasses.dataclass
class State:
    position: np.ndarray
    base: np.ndarray
    victim: np.ndarray
    held: np.ndarray
    saved: np.ndarray
    searched: np.ndarray
    next_cell: np.ndarray
    time: int


@dataclasses.dataclass
class Outcome:
    observation: np.ndarray
    local_rewards: dict[str, list[float]]
    team_reward: float
    terminated: bool
    truncated: bool


def centre(rules: Any, cell: int) -> np.ndarray:
    side = rules.world_size / rules.cells
    return np.array([(cell // rules.cells + 0.5) * side, (cell % rules.cells + 0.5) * side])


def moved(rules: Any, by: Decisions, state: State, action: np.ndarray, hands=None) -> State:
    """The first to the fifth rule. `hands`: how many of each agent there are."""
    position = state.position.copy()
    for agent in range(len(position)):
        bears = any(state.held[victim, agent] for victim in range(len(state.victim)))
        to = position[agent] + driven(action[agent], rules.carry_speed if bears else rules.max_speed)
        position[agent] = [min(rules.world_size, max(0.0, entry)) for entry in to]
    victim = carry(state.victim, state.held, position - state.position, rules.coupling, hands)
    held = let_go(by, position, victim, state.held, rules.reach, rules.coupling, hands)
    saved = state.saved.copy()
    for one in range(len(victim)):
        saved[one] |= by.within(far(victim[one], state.base), rules.base_radius)
        if saved[one]:
            held[one] = False
    held = lift(by, position, victim, held, ~saved, rules.reach, rules.coupling)
    return dataclasses.replace(
        state, position=position, victim=victim, held=held, saved=saved, time=state.time + 1
    )


def search(rules: Any, by: Decisions, state: State) -> State:
    """Marks what is searched, and gives each agent the cell that is next for it."""
    half_diagonal = rules.world_size / rules.cells / math.sqrt(2)
    searched = state.searched.copy()
    for cell in range(len(searched)):
        for place in state.position:
            searched[cell] |= by.within(far(place, centre(rules, cell)), rules.sensor_radius - half_diagonal)
    if searched.all():
        searched[:] = False
    left = [cell for cell in range(len(searched)) if not searched[cell]]
    next_cell = state.next_cell.copy()
    for agent in range(len(state.position)):
        distances = {cell: far(state.position[agent], centre(rules, cell)) for cell in left}
        own = {
            cell: mine
            for cell, mine in distances.items()
            if all(
                by.within(mine, far(other, centre(rules, cell)))
                for number, other in enumerate(state.position)
                if number != agent
            )
        }
        next_cell[agent] = by.first_nearest(own or distances)
    return dataclasses.replace(state, searched=searched, next_cell=next_cell)


class Views:
    """What all agents know of in a state."""

    def __init__(self, rules: Any, by: Decisions, state: State):
        self.rules, self.by, self.state = rules, by, state
        victims = range(len(state.victim))
        self.in_need = [one for one in victims if not state.saved[one] and not state.held[one].any()]

    def senses(self, agent: int, victim: int) -> bool:
        distance = far(self.state.position[agent], self.state.victim[victim])
        return victim in self.in_need and self.by.within(distance, self.rules.sensor_radius)

    def nearest(self, agent: int, victims: list[int]) -> int | None:
        return self.by.first_nearest(
            {one: far(self.state.position[agent], self.state.victim[one]) for one in victims}
        )

    def bears(self, agent: int) -> bool:
        return bool(self.state.held[:, agent].any())

    def own(self, agent: int) -> int | None:
        if self.bears(agent):
            return int(np.flatnonzero(self.state.held[:, agent])[0])
        return self.nearest(agent, [one for one in self.in_need if self.senses(agent, one)])

    def call(self, agent: int) -> int | None:
        others = [other for other in range(len(self.state.position)) if other != agent]
        return self.nearest(
            agent, [one for one in self.in_need if any(self.senses(other, one) for other in others)]
        )

    def neighbour(self, agent: int) -> np.ndarray:
        others = [other for other in range(len(self.state.position)) if other != agent]
        distances = {other: far(self.state.position[agent], self.state.position[other]) for other in others}
        return self.state.position[self.by.first_nearest(distances)]

    def helpers(self, agent: int) -> float:
        own = self.own(agent)
        if own is None:
            return 0.0
        if self.bears(agent):
            return 1.0
        place, reach = self.state.victim[own], self.rules.reach
        near = sum(self.by.within(far(one, place), reach) for one in self.state.position)
        return min(1.0, near / self.rules.coupling)

    def observation(self, agent: int) -> np.ndarray:
        state, here = self.state, self.state.position[agent]
        numbers: list[float] = [*(state.base - here)]
        for victim, between in (
            (self.own(agent), [self.helpers(agent), float(self.bears(agent))]),
            (self.call(agent), []),
        ):
            offset = np.zeros(2) if victim is None else state.victim[victim] - here
            numbers += [float(victim is not None), *offset, *between]
        numbers += [*(self.neighbour(agent) - here)]
        return np.array([*numbers, *(centre(self.rules, state.next_cell[agent]) - here)])

    def paid(self, agent: int, before: State) -> dict[str, float]:
        rules, here = self.rules, self.state.position[agent]

        def near(place, full):
            distance = far(here, place)
            return 1.0 if distance <= full else full / distance

        def near_victim(victim):
            return 0.0 if victim is None else near(self.state.victim[victim], rules.reach)

        goal = centre(rules, before.next_cell[agent])
        to_agent = near(self.neighbour(agent), rules.reach)
        return {
            "go_to_victim": near_victim(self.own(agent)),
            "go_to_call": near_victim(self.call(agent)),
            "go_to_base": near(self.state.base, rules.base_radius),
            "search": (far(before.position[agent], goal) - far(here, goal)) / rules.max_speed,
            "go_to_agent": to_agent,
            "go_away_from_agent": -to_agent,
        }


def team_reward(before: State, after: State) -> float:
    return float(after.saved.all() and not before.saved.all())


def step(rules: Any, state: State, action: np.ndarray) -> tuple[State, Outcome, float]:
    """The new state, what is returned with it, and how close any decision was."""
    by = Decisions()
    after = search(rules, by, moved(rules, by, state, action))
    views = Views(rules, by, after)
    agents = range(len(after.position))
    paid = [views.paid(agent, state) for agent in agents]
    done = bool(after.saved.all())
    outcome = Outcome(
        observation=np.stack([views.observation(agent) for agent in agents]),
        local_rewards={skill: [one[skill] for one in paid] for skill in paid[0]},
        team_reward=team_reward(state, after),
        terminated=done,
        truncated=after.time >= rules.episode_length and not done,
    )
    return after, outcome, by.gap
