"""The warehouse once more: one world, one thing at a time, written from docs/environments/warehouse.md."""

import dataclasses
from typing import Any

import numpy as np

from oracles.carrying import Decisions, carry, driven, far, let_go, lift


@dataclasses.dataclass
class State:
    position: np.ndarray
    gap: np.ndarray
    shelf: np.ndarray
    station: np.ndarray
    load: np.ndarray
    from_shelf: np.ndarray
    to_station: np.ndarray
    comes_at: np.ndarray
    held: np.ndarray
    delivered: np.ndarray
    time: int


@dataclasses.dataclass
class Outcome:
    observation: np.ndarray
    local_rewards: dict[str, list[float]]
    team_reward: float
    terminated: bool
    truncated: bool


def fellows(state: State, one: int, other: int) -> bool:
    return one == other or any(held[one] and held[other] for held in state.held)


def in_corridor(rules: Any, by: Decisions, place: np.ndarray) -> bool:
    half = rules.corridor_length / 2
    # Who was stopped at the wall stands exactly at its face, in whatever arithmetic.
    return abs(abs(place[0]) - half) > 1e-6 and not by.within(half, abs(place[0]))


def moved(rules: Any, by: Decisions, state: State, action: np.ndarray) -> np.ndarray:
    """The first rule: agent by agent, in the team's order."""
    half, room = rules.corridor_length / 2, rules.corridor_width / 2
    agents = range(len(state.position))
    inside = [in_corridor(rules, by, state.position[agent]) for agent in agents]
    entered: list[int] = []
    after = state.position.copy()
    for agent in agents:
        here = state.position[agent]
        bears = any(held[agent] for held in state.held)
        x, y = here + driven(action[agent], rules.carry_speed if bears else rules.max_speed)
        x = min(rules.length / 2, max(-rules.length / 2, x))
        y = min(rules.width / 2, max(-rules.width / 2, y))
        if inside[agent]:
            y = min(state.gap + room, max(state.gap - room, y))
        elif not by.within(half, abs(x)):
            at_gap = by.within(abs(y - state.gap), room)
            others = [other for other in agents if inside[other] and not fellows(state, agent, other)]
            before = [other for other in entered if not fellows(state, agent, other)]
            if at_gap and not others and not before:
                entered.append(agent)
            else:
                x = -half if here[0] < 0 else half
        after[agent] = x, y
    return after


def step_state(rules: Any, by: Decisions, state: State, action: np.ndarray) -> State:
    """All six rules."""
    position = moved(rules, by, state, action)
    load = carry(state.load, state.held, position - state.position, rules.coupling)
    held = let_go(by, position, load, state.held, rules.reach, rules.coupling)
    delivered = state.delivered.copy()
    for order in range(len(load)):
        if held[order].any():
            station = state.station[state.to_station[order]]
            if by.within(far(load[order], station), rules.station_radius):
                delivered[order], held[order] = True, False
        if not delivered[order] and not held[order].any():
            load[order] = state.shelf[state.from_shelf[order]]
    after = dataclasses.replace(
        state, position=position, load=load, held=held, delivered=delivered, time=state.time + 1
    )
    return lifted(rules, by, after)


def lifted(rules: Any, by: Decisions, state: State) -> State:
    """The sixth rule."""
    available = [
        not state.delivered[order] and state.comes_at[order] <= state.time for order in range(len(state.load))
    ]
    held = lift(by, state.position, state.load, state.held, available, rules.reach, rules.coupling)
    return dataclasses.replace(state, held=held)


def observation_of(rules: Any, by: Decisions, state: State, agent: int) -> np.ndarray:
    here, orders = state.position[agent], range(len(state.load))
    waits = [
        order
        for order in orders
        if state.comes_at[order] <= state.time and not state.delivered[order] and not state.held[order].any()
    ]
    numbers: list[float] = [-here[0], state.gap - here[1]]
    for place in [*state.shelf, *state.station]:
        numbers += [*(place - here)]
    for shelf in range(rules.n_shelves):
        numbers.append(float(any(state.from_shelf[order] == shelf for order in waits)))
    for place in state.shelf:
        near = sum(by.within(far(one, place), rules.reach) for one in state.position)
        numbers.append(min(1.0, near / rules.coupling))
    for station in range(rules.n_stations):
        mine = [state.held[order, agent] and state.to_station[order] == station for order in orders]
        numbers.append(float(any(mine)))
    others = [other for other in range(len(state.position)) if not fellows(state, agent, other)]
    numbers.append(float(any(in_corridor(rules, by, state.position[other]) for other in others)))
    return np.array(numbers)


def way(rules: Any, by: Decisions, state: State, agent: int, place: np.ndarray, side: int) -> float:
    """How far it is to a place: -1 in the store, 1 at the counter."""
    here, half = state.position[agent], rules.corridor_length / 2
    mouth, other_mouth = np.array([side * half, state.gap]), np.array([-side * half, state.gap])
    if in_corridor(rules, by, here):
        return far(here, mouth) + far(mouth, place)
    if side * here[0] > 0:
        return far(here, place)
    return far(here, other_mouth) + rules.corridor_length + far(mouth, place)


def paid(rules: Any, by: Decisions, state: State, agent: int) -> dict[str, float]:
    rewards = {}
    for places, names, side, full in (
        (state.shelf, [f"go_to_shelf_{chr(ord('A') + k)}" for k in range(rules.n_shelves)], -1, rules.reach),
        (
            state.station,
            [f"go_to_station_{k + 1}" for k in range(rules.n_stations)],
            1,
            rules.station_radius,
        ),
    ):
        for place, name in zip(places, names, strict=True):
            distance = way(rules, by, state, agent, place, side)
            rewards[name] = 1.0 if distance <= full else full / distance
    away = far(state.position[agent], np.array([0.0, float(state.gap)]))
    return {**rewards, "stand_aside": min(1.0, away / rules.corridor_length)}


def step(rules: Any, state: State, action: np.ndarray) -> tuple[State, Outcome, float]:
    """The new state, what is returned with it, and how close any decision was."""
    by = Decisions()
    after = step_state(rules, by, state, action)
    agents = range(len(after.position))
    rewards = [paid(rules, by, after, agent) for agent in agents]
    done = bool(after.delivered.all())
    outcome = Outcome(
        observation=np.stack([observation_of(rules, by, after, agent) for agent in agents]),
        local_rewards={skill: [one[skill] for one in rewards] for skill in rewards[0]},
        team_reward=float(done and not state.delivered.all()),
        terminated=done,
        truncated=after.time >= rules.episode_length and not done,
    )
    return after, outcome, by.gap
