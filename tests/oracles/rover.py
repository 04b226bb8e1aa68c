"""The Rover Domain once more: NumPy in float64, one world, one thing at a time.

Loops, an arctangent and a floor, and no cleverness: slow, but each rule can be read off and compared with
the thesis (chapter 4). It shares no code with `skillcrew`, so that both can only agree by being right. Where
rules go over many numbers, they go over lists: Python takes five times as long for those of an array.
"""

import dataclasses
import math

import numpy as np

from oracles.rover_rules import Outcome, State, World


def works(state: State, agent: int) -> bool:
    return state.breaks_at is None or state.time < state.breaks_at[agent]


def distance_between(here: np.ndarray, there: np.ndarray) -> float:
    return math.hypot(there[0] - here[0], there[1] - here[1])


def bearing_of(here: np.ndarray, heading: float, there: np.ndarray) -> float:
    """The angle from a rover's heading to a place, counter-clockwise, in [0, 2 pi)."""
    absolute = math.atan2(there[1] - here[1], there[0] - here[0])
    return (absolute - heading) % (2 * math.pi)


def sector_of(world: World, here: np.ndarray, heading: float, there: np.ndarray) -> int:
    if distance_between(here, there) == 0.0:
        return 0  # no bearing exists; the world puts it ahead
    width = 2 * math.pi / world.n_sectors
    return math.floor(bearing_of(here, heading, there) / width) % world.n_sectors


def add_reflection(world: World, cells: np.ndarray, sector: int, channel: int, strength: float) -> None:
    if world.closest_only:
        cells[sector, channel] = max(cells[sector, channel], strength)
    else:
        cells[sector, channel] += strength


def strength_of(world: World, value: float, distance: float) -> float:
    """Equations 4.1 and 4.2, the distance bounded from below; nothing beyond the radius."""
    if world.radius is not None and distance > world.radius:
        return 0.0
    return value / max(distance, world.min_distance) ** 2


def observation_of(world: World, state: State, agent: int) -> np.ndarray:
    """Sector after sector; in each the rovers' channel, then one per POI type; then who calls, if any may.

    Where rovers differ, each of their types has a channel.
    """
    position, heading = state.position.tolist(), float(state.heading[agent])
    here = position[agent]
    rover_types, world = max(1, len(world.kinds)), world.of(agent)
    cells = np.zeros((world.n_sectors, rover_types + world.n_types))
    for other in range(world.n_agents):
        if other == agent or not works(state, other):
            continue
        there = position[other]
        strength = strength_of(world, 1.0, distance_between(here, there))
        channel = world.kind_of(other) if world.kinds else 0
        add_reflection(world, cells, sector_of(world, here, heading, there), channel, strength)
    for poi, there in enumerate(state.poi_position.tolist()):
        if world.vanish and state.observed[poi]:
            continue
        value = world.poi_values[poi]
        strength = strength_of(world, value, distance_between(here, there))
        sector = sector_of(world, here, heading, there)
        add_reflection(world, cells, sector, rover_types + world.poi_types[poi], strength)
    calls = [kind == next_type(world, state) for kind in range(world.n_types)] if world.order_drawn else []
    return np.concatenate([cells.reshape(-1), np.array(calls, float)])


def observe(world: World, state: State) -> np.ndarray:
    """What all rovers sense, in rows; those who sense less have zeros behind it."""
    rows = [observation_of(world, state, agent) for agent in range(world.n_agents)]
    observed = np.zeros((world.n_agents, max(map(len, rows))))
    for agent, row in enumerate(rows):
        observed[agent, : len(row)] = row
    return observed


def moved(world: World, state: State, action: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The places and headings after each rover turned, then drove along its new heading."""
    position, heading = state.position.copy(), state.heading.copy()
    for agent, (turn, drive) in enumerate(action.tolist()):
        if not works(state, agent):
            continue
        turn = min(1.0, max(-1.0, turn))
        drive = min(1.0, max(-1.0, drive))
        (x, y), towards = position[agent].tolist(), float(heading[agent]) + turn * world.of(agent).max_turn
        length = (drive + 1) / 2 * world.of(agent).max_speed
        x += length * math.cos(towards)
        y += length * math.sin(towards)
        if world.bounded:
            x = min(world.world_size, max(0.0, x))
            y = min(world.world_size, max(0.0, y))
        position[agent], heading[agent] = (x, y), towards
    return position, heading


def drifted(world: World, state: State) -> tuple[np.ndarray, np.ndarray | None]:
    """The places of the POIs after a step, and their directions: on each axis there and back, for ever."""
    position, direction = state.poi_position.copy(), state.poi_direction
    if direction is None:
        return position, None
    direction = direction.copy()
    for poi in range(world.n_pois):
        for axis in (0, 1):
            along = float(position[poi, axis] + world.poi_speed * direction[poi, axis])
            along %= 2 * world.world_size
            position[poi, axis] = world.world_size - abs(along - world.world_size)
            if along > world.world_size:
                direction[poi, axis] *= -1
    return position, direction


def types_observed(world: World, observed: np.ndarray) -> list[bool]:
    """A type is observed with the first of its POIs."""
    done = [False] * world.n_types
    for poi in range(world.n_pois):
        if observed[poi]:
            done[world.poi_types[poi]] = True
    return done


def next_type(world: World, state: State) -> int | None:
    """The first in the drawn order that is not observed; None without such an order, or at its end."""
    if state.order is None:
        return None
    done = types_observed(world, state.observed)
    for place in range(world.n_types):
        kind = list(state.order).index(place)
        if not done[kind]:
            return kind
    return None


def may_be_observed(world: World, state: State, kind: int) -> bool:
    """Whether all that comes before a type was observed at an earlier step."""
    done = types_observed(world, state.observed)
    before = world.parents[kind]
    if state.order is not None:
        before = [other for other in range(world.n_types) if state.order[other] < state.order[kind]]
    return all(done[other] for other in before)


def rovers_near(world: World, state: State, place: np.ndarray) -> list[int]:
    near, place = [], np.asarray(place).tolist()
    for agent, here in enumerate(state.position.tolist()):
        within = distance_between(here, place) <= world.activation_distance
        if within and works(state, agent):
            near.append(agent)
    return near


def enough_near(world: World, state: State, place: np.ndarray) -> bool:
    """Whether there are as many rovers as a POI takes; of each type, where they differ."""
    near = rovers_near(world, state, place)
    if not world.kinds:
        return len(near) >= world.coupling
    kinds = [world.kind_of(agent) for agent in near]
    return all(kinds.count(place) >= kind.coupling for place, kind in enumerate(world.kinds))


def is_met(world: World, state: State, poi: int) -> bool:
    """Whether enough rovers are near a POI whose turn it is."""
    return enough_near(world, state, state.poi_position[poi]) and may_be_observed(
        world, state, world.poi_types[poi]
    )


def visited_now(world: World, state: State) -> list[bool]:
    """The couplings: enough rovers at this very time, all parents at an earlier one, groups together.

    Args:
        state: everything has moved; what is observed, and the time, are those before the step.
    """
    met = [is_met(world, state, poi) for poi in range(world.n_pois)]
    types_met = {world.poi_types[poi] for poi in range(world.n_pois) if met[poi]}
    visited = []
    for poi in range(world.n_pois):
        group = {world.poi_types[poi]}
        for together in world.groups:
            if world.poi_types[poi] in together:
                group = set(together)
        visited.append(met[poi] and group <= types_met)
    return visited


def value_over_distance(world: World, state: State, poi: int) -> float:
    """What a visit is worth: the POI's value over the mean distance of the rovers that it takes."""
    place, distances = state.poi_position[poi], []
    working = [agent for agent in range(world.n_agents) if works(state, agent)]
    couplings = [kind.coupling for kind in world.kinds] or [world.coupling]
    for kind, coupling in enumerate(couplings):
        own = [agent for agent in working if not world.kinds or world.kind_of(agent) == kind]
        distances += sorted(distance_between(state.position[agent], place) for agent in own)[:coupling]
    return world.poi_values[poi] / max(sum(distances) / len(distances), world.min_distance)


def after_visits(world: World, state: State) -> State:
    """The end of a step: what is observed, the best visit of each POI if that is paid, and the time.

    Args:
        state: as in `visited_now`.
    """
    observed, best = state.observed.copy(), None if state.best is None else state.best.copy()
    for poi, visited in enumerate(visited_now(world, state)):
        if visited:
            observed[poi] = True
            if best is not None:
                best[poi] = max(best[poi], value_over_distance(world, state, poi))
    return dataclasses.replace(state, observed=observed, best=best, time=state.time + 1)


def closeness(world: World, distances: list[float]) -> float:
    """1 within the activation distance of the closest, falling with the distance; 0 if nothing is there."""
    if not distances:
        return 0.0
    if min(distances) <= world.activation_distance:
        return 1.0
    return world.activation_distance / min(distances)


def local_rewards_of(world: World, state: State) -> dict[str, np.ndarray]:
    """Per skill and agent; a POI that vanishes still pays in the step in which it is observed.

    Args:
        state: everything has moved; what is observed, and the time, are those before the step.
    """
    position, poi_position = state.position.tolist(), state.poi_position.tolist()
    rewards: dict[str, np.ndarray] = {}
    for kind in range(world.n_types):
        letter = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"[kind]
        reward = np.zeros(world.n_agents)
        for agent in range(world.n_agents):
            distances = []
            for poi in range(world.n_pois):
                gone = world.vanish and state.observed[poi]
                if world.poi_types[poi] == kind and not gone:
                    distances.append(distance_between(position[agent], poi_position[poi]))
            reward[agent] = closeness(world, distances)
        rewards[f"go_to_poi_{letter}"] = reward
        rewards[f"go_away_from_poi_{letter}"] = -reward
    if world.n_agents > 1:
        reward = np.zeros(world.n_agents)
        for agent in range(world.n_agents):
            distances = []
            for other in range(world.n_agents):
                if other != agent and works(state, other):
                    distances.append(distance_between(position[agent], position[other]))
            reward[agent] = closeness(world, distances)
        rewards["go_to_agent"] = reward
        rewards["go_away_from_agent"] = -reward
    return by_kind(world, rewards) if world.kinds else rewards


def by_kind(world: World, rewards: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The same skills for each type of rovers; nobody is paid for those of another type."""
    kinds = [world.kind_of(agent) for agent in range(world.n_agents)]
    return {
        f"{kind.name}/{skill}": reward * (np.array(kinds) == place)
        for place, kind in enumerate(world.kinds)
        for skill, reward in rewards.items()
    }


def shown(world: World, state: State) -> float:
    """How much of the task is done, from 0 to 1; the team is paid for what it grows by."""
    done = types_observed(world, state.observed)
    if world.team_reward == "binary":
        return float(all(done))
    if world.team_reward == "fraction":
        return sum(done) / world.n_types
    if world.team_reward == "value":
        return sum(world.poi_values[poi] for poi in np.flatnonzero(state.observed)) / sum(world.poi_values)
    return sum(state.best) / sum(value / world.min_distance for value in world.poi_values)


def is_done(world: World, state: State) -> bool:
    """Whether nothing is left to be paid for; a visit may always be closer."""
    if world.team_reward == "closest":
        return False
    return all(state.observed) if world.team_reward == "value" else all(types_observed(world, state.observed))


def advanced(world: World, state: State, action: np.ndarray) -> tuple[State, State]:
    """Everything has moved, first with what was observed before, then with what is observed now."""
    position, heading = moved(world, state, action)
    poi_position, poi_direction = drifted(world, state)
    there = dataclasses.replace(
        state, position=position, heading=heading, poi_position=poi_position, poi_direction=poi_direction
    )
    return there, after_visits(world, there)


def step(world: World, state: State, action: np.ndarray) -> tuple[State, Outcome]:
    """One step of one world: move, observe POIs, pay, sense."""
    there, after = advanced(world, state, action)
    terminated = is_done(world, after)
    return after, Outcome(
        observation=observe(world, after),
        local_rewards=local_rewards_of(world, there),
        team_reward=shown(world, after) - shown(world, state),
        terminated=terminated,
        truncated=after.time >= world.episode_length and not terminated,
    )
