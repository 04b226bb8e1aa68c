"""The Rover Domain once more: NumPy in float64, one world, one thing at a time.

Loops, an arctangent and a floor, and no cleverness: slow, but each rule can be read off and compared with
the thesis (chapter 4). It shares no code with `skillcrew`, so that both can only agree by being right.
"""

import dataclasses
import math

import numpy as np


@dataclasses.dataclass(frozen=True)
class World:
    """The rules of one Rover Domain."""

    n_agents: int
    poi_types: tuple[int, ...]
    """The type of each POI, as an index."""
    poi_values: tuple[float, ...]
    """The value of each POI, V in equation 4.2."""
    coupling: int
    parents: tuple[tuple[int, ...], ...]
    """For each type, the types to be observed before it."""
    episode_length: int
    world_size: float
    bounded: bool
    max_turn: float
    max_speed: float
    activation_distance: float
    min_distance: float
    closest_only: bool
    """Whether a sector returns its strongest reflector alone, instead of the sum."""
    n_sectors: int
    radius: float | None
    """How far a rover senses; None for no limit."""
    vanish: bool
    """Whether observed POIs leave the world."""
    fraction: bool
    """Whether the team is paid for each type, instead of once for all."""

    @property
    def n_types(self) -> int:
        return len(self.parents)

    @property
    def n_pois(self) -> int:
        return len(self.poi_types)


@dataclasses.dataclass
class State:
    """Where everything is; float64 arrays."""

    position: np.ndarray
    heading: np.ndarray
    poi_position: np.ndarray
    observed: np.ndarray
    time: int


@dataclasses.dataclass
class Outcome:
    """What one step returns beside the new state."""

    observation: np.ndarray
    local_rewards: dict[str, np.ndarray]
    """Per skill's name, one reward per agent."""
    team_reward: float
    terminated: bool
    truncated: bool


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
    """Sector after sector; in each the rovers' channel, then one per POI type."""
    here, heading = state.position[agent], state.heading[agent]
    cells = np.zeros((world.n_sectors, 1 + world.n_types))
    for other in range(world.n_agents):
        if other == agent:
            continue
        there = state.position[other]
        strength = strength_of(world, 1.0, distance_between(here, there))
        add_reflection(world, cells, sector_of(world, here, heading, there), 0, strength)
    for poi in range(world.n_pois):
        if world.vanish and state.observed[poi]:
            continue
        there = state.poi_position[poi]
        strength = strength_of(world, world.poi_values[poi], distance_between(here, there))
        sector = sector_of(world, here, heading, there)
        add_reflection(world, cells, sector, 1 + world.poi_types[poi], strength)
    return cells.reshape(-1)


def observe(world: World, state: State) -> np.ndarray:
    return np.stack([observation_of(world, state, agent) for agent in range(world.n_agents)])


def moved(world: World, state: State, action: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The places and headings after each rover turned, then drove along its new heading."""
    position, heading = state.position.copy(), state.heading.copy()
    for agent in range(world.n_agents):
        turn = min(1.0, max(-1.0, action[agent, 0]))
        drive = min(1.0, max(-1.0, action[agent, 1]))
        heading[agent] += turn * world.max_turn
        length = (drive + 1) / 2 * world.max_speed
        position[agent, 0] += length * math.cos(heading[agent])
        position[agent, 1] += length * math.sin(heading[agent])
        if world.bounded:
            position[agent, 0] = min(world.world_size, max(0.0, position[agent, 0]))
            position[agent, 1] = min(world.world_size, max(0.0, position[agent, 1]))
    return position, heading


def types_observed(world: World, observed: np.ndarray) -> list[bool]:
    """A type is observed with the first of its POIs."""
    done = [False] * world.n_types
    for poi in range(world.n_pois):
        if observed[poi]:
            done[world.poi_types[poi]] = True
    return done


def rovers_near(world: World, position: np.ndarray, place: np.ndarray) -> int:
    near = 0
    for agent in range(world.n_agents):
        if distance_between(position[agent], place) <= world.activation_distance:
            near += 1
    return near


def observed_after(world: World, state: State, position: np.ndarray) -> np.ndarray:
    """Both couplings: enough rovers at this very time, and all parents at an earlier one."""
    done_before = types_observed(world, state.observed)
    observed = state.observed.copy()
    for poi in range(world.n_pois):
        parents_done = True
        for parent in world.parents[world.poi_types[poi]]:
            if not done_before[parent]:
                parents_done = False
        if parents_done and rovers_near(world, position, state.poi_position[poi]) >= world.coupling:
            observed[poi] = True
    return observed


def closeness(world: World, distances: list[float]) -> float:
    """1 within the activation distance of the closest, falling with the distance; 0 if nothing is there."""
    if not distances:
        return 0.0
    if min(distances) <= world.activation_distance:
        return 1.0
    return world.activation_distance / min(distances)


def local_rewards_of(
    world: World, position: np.ndarray, poi_position: np.ndarray, observed_before: np.ndarray
) -> dict[str, np.ndarray]:
    """Per skill and agent; a POI that vanishes still pays in the step in which it is observed."""
    rewards: dict[str, np.ndarray] = {}
    for kind in range(world.n_types):
        letter = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"[kind]
        reward = np.zeros(world.n_agents)
        for agent in range(world.n_agents):
            distances = []
            for poi in range(world.n_pois):
                gone = world.vanish and observed_before[poi]
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
                if other != agent:
                    distances.append(distance_between(position[agent], position[other]))
            reward[agent] = closeness(world, distances)
        rewards["go_to_agent"] = reward
        rewards["go_away_from_agent"] = -reward
    return rewards


def team_reward_of(world: World, done_before: list[bool], done_after: list[bool]) -> float:
    if world.fraction:
        return (sum(done_after) - sum(done_before)) / world.n_types
    return 1.0 if all(done_after) and not all(done_before) else 0.0


def step(world: World, state: State, action: np.ndarray) -> tuple[State, Outcome]:
    """One step of one world: move, observe POIs, pay, sense."""
    position, heading = moved(world, state, action)
    observed = observed_after(world, state, position)
    after = State(position, heading, state.poi_position.copy(), observed, state.time + 1)
    done_before = types_observed(world, state.observed)
    done_after = types_observed(world, observed)
    terminated = all(done_after)
    return after, Outcome(
        observation=observe(world, after),
        local_rewards=local_rewards_of(world, position, state.poi_position, state.observed),
        team_reward=team_reward_of(world, done_before, done_after),
        terminated=terminated,
        truncated=after.time >= world.episode_length and not terminated,
    )
