"""Rover Domains that between them use every option, random worlds in them, and the oracle's answers.

All arrays have the world axis last, as in `Environment.step_worlds`. A configuration is compiled once per
process, because compiling is what makes these tests slow.
"""

import dataclasses
import functools
import itertools
import math
from typing import Any

import jax
import numpy as np

from oracles import rover
from oracles import rover_rules as rules
from skillcrew.envs.environment import Environment
from skillcrew.envs.padded import uniform
from skillcrew.envs.rover.config import RoverConfig
from skillcrew.envs.rover.crew import RoverType
from skillcrew.envs.rover.world import RoverDomain, RoverState

# The published values, written out again so that a changed default is noticed.
DEFAULTS: dict[str, Any] = dict(
    n_agents=1, n_poi_types=2, pois_per_type=1, poi_values=None, spatial_coupling=1, parents=None,
    episode_length=50, world_size=20.0, bounded=False, max_turn=math.pi, max_speed=1.0,
    activation_distance=2.0, min_distance=1.0, sensor="density", sensor_resolution=90,
    observation_radius=None, observed_pois="persist", team_reward="binary", simultaneous=(), order="fixed",
    poi_speed=0.0, breakdowns=0, rover_types=(),
)  # fmt: skip

# Counts differ from one another wherever they can, so that no two axes can be mistaken for each other.
CASES: dict[str, dict[str, Any]] = {
    "lone rover": dict(pois_per_type=3, world_size=12.0, observed_pois="vanish"),
    "thesis t3 c2": dict(n_agents=4, n_poi_types=3, spatial_coupling=2, episode_length=70),
    "occluded 45": dict(
        n_agents=3, pois_per_type=2, poi_values=(2.0, 0.5), spatial_coupling=2, sensor="closest",
        sensor_resolution=45, world_size=9.0, min_distance=0.5,
    ),
    "graph 120": dict(
        n_agents=5, n_poi_types=4, pois_per_type=2, poi_values=(1.0, 3.0, 0.5, 2.0), spatial_coupling=2,
        parents={"C": ("A", "B"), "D": ()}, sensor_resolution=120, team_reward="fraction", episode_length=9,
    ),
    "vanish 180": dict(
        n_agents=2, n_poi_types=3, pois_per_type=2, poi_values=(0.7, 1.0, 4.0),
        parents={"A": ("C",), "B": ("A", "C")},
        observed_pois="vanish", observation_radius=5.0, bounded=True, sensor_resolution=180,
        team_reward="fraction", world_size=8.0,
    ),
    "vanish occluded 360": dict(
        n_agents=3, n_poi_types=4, spatial_coupling=2, parents={"B": ("D",), "A": ("B",)}, sensor="closest",
        observed_pois="vanish", observation_radius=6.0, sensor_resolution=360, episode_length=1,
    ),
    "six in threes": dict(
        n_agents=6, spatial_coupling=3, max_turn=1.0, max_speed=2.5, activation_distance=3.0, world_size=10.0,
        bounded=True, sensor_resolution=72, parents={"A": ("B",)}, team_reward="fraction",
    ),
    "groups moving": dict(
        n_agents=5, n_poi_types=4, pois_per_type=2, spatial_coupling=2, simultaneous=(("A", "C"), ("B", "D")),
        poi_speed=0.8, observed_pois="vanish", world_size=9.0, sensor_resolution=180, episode_length=11,
    ),
    "groups breaking": dict(
        n_agents=5, n_poi_types=4, simultaneous=(("C", "A"),), parents={"D": ("A",), "C": ("B",)},
        breakdowns=3, bounded=True, team_reward="fraction", world_size=10.0, observation_radius=7.0,
    ),
    "drawn": dict(
        n_agents=3, n_poi_types=3, pois_per_type=2, poi_values=(0.5, 2.0, 1.0), order="drawn",
        breakdowns=1, poi_speed=6.0, spatial_coupling=2, sensor="closest", observed_pois="vanish",
        world_size=6.0, sensor_resolution=120,
    ),
    "drawn persisting": dict(
        n_agents=2, n_poi_types=3, order="drawn", poi_speed=0.3, sensor_resolution=360, world_size=12.0,
        observation_radius=9.0, team_reward="fraction", breakdowns=1,
    ),
    "crew": dict(
        pois_per_type=3, world_size=9.0, observed_pois="vanish", team_reward="fraction",
        rover_types=(
            RoverType("scout", 3, 2, max_speed=1.5, observation_radius=6.0, sensor_resolution=90),
            RoverType("hauler", 2, 1, max_turn=1.0, max_speed=0.5, sensor_resolution=120),
            RoverType("kite", 1, 0, 2.0, 4.0, observation_radius=3.0, sensor_resolution=360),
        ),
    ),
    "crew drawn": dict(
        n_poi_types=2, order="drawn", poi_speed=0.4, bounded=True, sensor="closest", world_size=8.0,
        rover_types=(RoverType("mast", 1, 1, sensor_resolution=180), RoverType("cart", 3, 2, 0.5, 2.0, 5.0)),
    ),
    "value": dict(
        n_agents=4, n_poi_types=3, pois_per_type=2, poi_values=(1.0, 3.0, 0.5), spatial_coupling=2,
        parents={"B": ("C",)}, observed_pois="vanish", world_size=8.0, sensor_resolution=180,
        team_reward="value", episode_length=9,
    ),
    "value of groups": dict(
        n_agents=6, n_poi_types=4, pois_per_type=3, poi_values=(2.0, 0.5, 1.0, 4.0), spatial_coupling=2,
        simultaneous=(("A", "C"),), breakdowns=1, world_size=10.0, sensor_resolution=360, team_reward="value",
    ),
    "closest": dict(
        n_agents=5, n_poi_types=2, pois_per_type=3, poi_values=(0.5, 2.0), spatial_coupling=3, breakdowns=2,
        min_distance=0.8, activation_distance=3.0, observed_pois="vanish", world_size=9.0,
        sensor_resolution=120, team_reward="closest",
    ),
    "closest of groups": dict(
        n_agents=6, n_poi_types=4, pois_per_type=2, poi_values=(1.0, 3.0, 0.5, 2.0), spatial_coupling=2,
        simultaneous=(("B", "D"),), parents={"B": ("A",)}, poi_speed=0.6, world_size=9.0,
        sensor_resolution=360, team_reward="closest", episode_length=11,
    ),
    "closest alone": dict(
        n_agents=3, n_poi_types=4, order="drawn", min_distance=0.4, bounded=True, world_size=6.0,
        sensor_resolution=180, team_reward="closest",
    ),
    "closest of a crew": dict(
        n_poi_types=3, pois_per_type=2, poi_values=(1.0, 0.25, 3.0), world_size=8.0, team_reward="closest",
        rover_types=(
            RoverType("scout", 4, 2, max_speed=1.5, sensor_resolution=360),
            RoverType("kite", 1, 0, 2.0, 4.0, observation_radius=3.0, sensor_resolution=180),
            RoverType("hauler", 3, 1, max_turn=1.0, max_speed=0.5, sensor_resolution=360),
        ),
    ),
}  # fmt: skip

NEVER = 2**31 - 1
"""The step at which a rover that does not break down breaks down."""
BORDER = 1e-4
"""Metres from a border at which float32 may differ: of a sector, the radius, the activation distance, and of
the square if POIs move."""


WORLDS = 80
"""Worlds in a batch; always the same number, since each number is another compilation."""


def array(values: Any, dtype: str) -> jax.Array:
    """Made by NumPy: JAX would compile a conversion for each shape."""
    return jax.numpy.asarray(np.asarray(values, dtype))


@functools.cache
def environment(case: str) -> Environment:
    """With arrays over all rovers, also where they differ."""
    return uniform(RoverDomain(RoverConfig(**CASES[case])))


@functools.cache
def compiled_step(case: str):
    return jax.jit(environment(case).step_worlds)


@functools.cache
def compiled_reset(case: str):
    return jax.jit(environment(case).reset_worlds)


def oracle_world(**fields: Any) -> rover.World:
    """The oracle's rules for the fields of a `RoverConfig`, worked out apart from it."""
    given = {**DEFAULTS, **fields}
    letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"[: given["n_poi_types"]]
    values = given["poi_values"] or (1.0,) * len(letters)
    kinds = [kind for kind in range(len(letters)) for _ in range(given["pois_per_type"])]
    chain = {after: (before,) for before, after in itertools.pairwise(letters)}
    groups = tuple(tuple(sorted(map(letters.index, group))) for group in given["simultaneous"])
    if groups:
        chain = chain_of_groups(letters, groups)
    graph = chain if given["parents"] is None else given["parents"]
    crew = tuple(
        rules.Kind(
            name=kind.name,
            rovers=kind.rovers,
            coupling=kind.coupling,
            max_turn=kind.max_turn,
            max_speed=kind.max_speed,
            n_sectors=360 // kind.sensor_resolution,
            radius=kind.observation_radius,
        )
        for kind in given["rover_types"]
    )
    return rover.World(
        n_agents=sum(kind.rovers for kind in crew) or given["n_agents"],
        poi_types=tuple(kinds),
        poi_values=tuple(values[kind] for kind in kinds),
        coupling=given["spatial_coupling"],
        parents=tuple(tuple(letters.index(p) for p in graph.get(letter, ())) for letter in letters),
        episode_length=given["episode_length"],
        world_size=given["world_size"],
        bounded=given["bounded"],
        max_turn=given["max_turn"],
        max_speed=given["max_speed"],
        activation_distance=given["activation_distance"],
        min_distance=given["min_distance"],
        closest_only=given["sensor"] == "closest",
        n_sectors=360 // given["sensor_resolution"],
        radius=given["observation_radius"],
        vanish=given["observed_pois"] == "vanish",
        team_reward=given["team_reward"],
        groups=groups,
        order_drawn=given["order"] == "drawn",
        poi_speed=given["poi_speed"],
        breakdowns=given["breakdowns"],
        kinds=crew,
    )


def chain_of_groups(letters: str, groups: tuple[tuple[int, ...], ...]) -> dict[str, tuple[str, ...]]:
    """Walks along the types; whoever comes first in its group, or has none, follows all of the last one."""
    graph, last = {}, ()
    for kind in range(len(letters)):
        group = next((group for group in groups if kind in group), (kind,))
        if kind == group[0]:
            for member in group:
                graph[letters[member]] = tuple(letters[above] for above in last)
            last = group
    return graph


def random_observed(world: rover.World, rng: np.random.Generator, meeting: list[int]) -> np.ndarray:
    """Which POIs were observed: in a fair share of worlds, all types but those of the meeting places.

    Where all POIs are to be observed, all but the meeting places themselves.
    """
    each = world.team_reward == "value"
    if rng.random() < (0.5 if each else 0.25):
        if each:
            return np.array([poi not in meeting for poi in range(world.n_pois)])
        kinds = [world.poi_types[poi] for poi in meeting]
        return np.array([kind not in kinds for kind in world.poi_types])
    return rng.random(world.n_pois) < rng.choice([0.0, 0.3, 0.7])


def random_meeting(world: rover.World, rng: np.random.Generator) -> list[int]:
    """A POI; or one of each type that is to be observed at the same time."""
    meeting = int(rng.integers(world.n_pois))
    for group in world.groups:
        if world.poi_types[meeting] in group:
            return [int(rng.choice(np.flatnonzero(np.array(world.poi_types) == kind))) for kind in group]
    return [meeting]


def random_states(world: rover.World, rng: np.random.Generator, worlds: int = WORLDS) -> RoverState:
    """States in which much happens: most rovers near one POI, the episode often about to end."""
    size = world.world_size
    pois = rng.uniform(0, size, (world.n_pois, 2, worlds))
    position = rng.uniform(0, size, (world.n_agents, 2, worlds))
    observed = np.zeros((world.n_pois, worlds), bool)
    time = rng.integers(0, world.episode_length, worlds)
    for w in range(worlds):
        meeting = random_meeting(world, rng)
        for agent in range(world.n_agents):
            if rng.random() < 0.75:
                place = pois[meeting[agent % len(meeting)], :, w]
                angle, reach = rng.uniform(0, 2 * np.pi), rng.uniform(0, 1.3 * world.activation_distance)
                position[agent, :, w] = place + reach * np.array([np.cos(angle), np.sin(angle)])
        observed[:, w] = random_observed(world, rng, meeting)
        if rng.random() < 0.3:
            time[w] = world.episode_length - 1
    if world.bounded:
        position = position.clip(0, size)
    return RoverState(
        position=array(position, "float32"),
        heading=array(rng.uniform(-np.pi, np.pi, (world.n_agents, worlds)), "float32"),
        poi_position=array(pois, "float32"),
        observed=array(observed, "bool"),
        time=array(time, "int32"),
        **random_options(world, rng, time, observed),
    )


def random_options(
    world: rover.World, rng: np.random.Generator, time: np.ndarray, observed: np.ndarray
) -> dict[str, jax.Array]:
    """What the state holds for options: POIs under way, orders, rovers broken, about to break and sound, and
    how near POIs were visited that were."""
    state, worlds = {}, len(time)
    if world.poi_speed:
        course = rng.uniform(0, 2 * np.pi, (world.n_pois, worlds))
        state["poi_direction"] = array(np.stack([np.cos(course), np.sin(course)], 1), "float32")
    if world.order_drawn:
        orders = np.stack([rng.permutation(world.n_types) for _ in range(worlds)], axis=-1)
        state["order"] = array(orders, "int32")
    if world.breakdowns:
        breaks_at = np.full((world.n_agents, worlds), NEVER)
        for w in range(worlds):
            who = rng.choice(world.n_agents, world.breakdowns, replace=False)
            breaks_at[who, w] = time[w] + rng.integers(-2, 4, len(who))
        state["breaks_at"] = array(breaks_at, "int32")
    if world.team_reward == "closest":
        farthest = min(1.0, world.min_distance / world.activation_distance)
        closest = observed * rng.uniform(farthest, 1.0, observed.shape)
        state["closest"] = array(closest, "float32")
    return state


def random_actions(world: rover.World, rng: np.random.Generator, worlds: int = WORLDS) -> jax.Array:
    """Some beyond [-1, 1], which are to be clipped."""
    return array(rng.uniform(-1.3, 1.3, (world.n_agents, 2, worlds)), "float32")


def one_world(world: rover.World, states: RoverState, w: int) -> rover.State:
    return rover.State(
        position=np.asarray(states.position, np.float64)[..., w],
        heading=np.asarray(states.heading, np.float64)[..., w],
        poi_position=np.asarray(states.poi_position, np.float64)[..., w],
        observed=np.asarray(states.observed)[..., w],
        time=int(states.time[w]),
        **{
            option: None if getattr(states, option) is None else np.asarray(getattr(states, option))[..., w]
            for option in ("poi_direction", "order", "breaks_at")
        },
        best=None if states.closest is None else best_visits(world, states.closest)[..., w],
    )


def best_visits(world: rover.World, closest: jax.Array) -> np.ndarray:
    """Value over distance, [pois, ...], of the closeness that our states hold."""
    most = np.array(world.poi_values) / world.min_distance
    return (np.asarray(closest, np.float64).T * most).T


def gap_to_borders(world: rover.World, state: rover.State) -> float:
    """How far, in metres, the state is from one that rounding could turn into another outcome."""
    gap = math.inf
    if world.poi_speed:
        gap = float(np.minimum(state.poi_position, world.world_size - state.poi_position).min())
    position, heading = state.position.tolist(), state.heading.tolist()
    for agent, here in enumerate(position):
        own = world.of(agent)
        width = 2 * math.pi / own.n_sectors
        for there in [*position[:agent], *position[agent + 1 :], *state.poi_position.tolist()]:
            distance = rover.distance_between(here, there)
            gap = min(gap, abs(distance - world.activation_distance))
            if own.radius is not None:
                gap = min(gap, abs(distance - own.radius))
            if own.n_sectors > 1:
                beyond = rover.bearing_of(here, heading[agent], there) % width
                gap = min(gap, distance * math.sin(min(beyond, width - beyond, math.pi / 2)))
    return gap


@dataclasses.dataclass
class Answers:
    """What the oracle says of one step of many worlds, leaving out those too close to a border."""

    kept: np.ndarray
    """Which worlds were far enough from every border."""
    before: list[rover.State]
    after: list[rover.State]
    outcomes: list[rover.Outcome]

    def of_after(self, field: str) -> np.ndarray:
        return np.stack([np.asarray(getattr(state, field)) for state in self.after], axis=-1)

    def of_outcome(self, field: str) -> np.ndarray:
        return np.stack([np.asarray(getattr(outcome, field)) for outcome in self.outcomes], axis=-1)

    def local_rewards(self, skills: tuple[str, ...]) -> np.ndarray:
        """Agents, skills, worlds, in the order of the skills' names."""
        per_world = [[outcome.local_rewards[skill] for skill in skills] for outcome in self.outcomes]
        return np.array(per_world).transpose(2, 1, 0)


def answers(world: rover.World, states: RoverState, actions: jax.Array) -> Answers:
    kept = np.zeros(actions.shape[-1], bool)
    said = Answers(kept, [], [], [])
    states, acted = jax.device_get(states), np.asarray(actions, np.float64)
    for w in range(len(kept)):
        before = one_world(world, states, w)
        after, outcome = rover.step(world, before, acted[..., w])
        if gap_to_borders(world, after) > BORDER:
            kept[w] = True
            said.before.append(before)
            said.after.append(after)
            said.outcomes.append(outcome)
    return said
