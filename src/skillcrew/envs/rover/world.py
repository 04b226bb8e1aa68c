"""The Rover Domain: a team of rovers that must observe POIs together, and in order."""

import dataclasses
import functools
from collections.abc import Mapping, Sequence
from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, Key

from skillcrew.envs.agent_type import AgentType
from skillcrew.envs.environment import Environment, TimeStep, TimeStepByType
from skillcrew.envs.rover import coupling, rewards
from skillcrew.envs.rover.config import RoverConfig
from skillcrew.envs.rover.crew import RoverType, ranks
from skillcrew.envs.rover.motion import Direction, direction_of, moved
from skillcrew.envs.rover.presets import PRESETS
from skillcrew.envs.rover.scene import scene, skill_texts
from skillcrew.envs.rover.sensors import Reflections, Reflector
from skillcrew.envs.rover.state import Progress, RoverState, draw_state
from skillcrew.envs.scene import Scene


class RoverDomain(Environment):
    """Rovers with a turn and a drive each, in a square with POIs of several types.

    All positions are redrawn at every reset: rovers in the central 30 % of each axis with any
    heading, POIs anywhere in the square. The action's first entry turns by up to `max_turn`, its
    second drives 0 to `max_speed` along the new heading; entries beyond [-1, 1] are clipped. Where
    rovers differ (`RoverConfig.rover_types`), observations, actions and local rewards are
    dictionaries by type.
    """

    name = "rover"
    success = "terminated"
    input_scaling = "sqrt"
    config_class = RoverConfig
    presets = PRESETS

    def __init__(self, config: RoverConfig):
        self.config = config
        self.crew = ranks(config.crew)
        self.episode_length = config.episode_length
        if config.team_reward == "closest":
            self.success = None  # A visit may always be closer: the task is never done.
        kinds = [self._agent_type(kind) for kind in config.crew]
        if config.rover_types:
            self.types = tuple(kinds)
        else:
            alike = kinds[0]
            self.n_agents, self.skills = alike.agents, alike.skills
            self.observation_size, self.action_size = alike.observation_size, alike.action_size
        self.skill_texts: Mapping[str, str] = skill_texts(self.skills)
        names = {kind.name: self._names_of_sensed(kind) for kind in config.crew}
        self.observation_names = names if self.types else names[config.crew[0].name]

    def _agent_type(self, kind: RoverType) -> AgentType:
        channels = len(self.crew) + self.config.n_poi_types
        calls = self.config.n_poi_types if self.config.order == "drawn" else 0
        return AgentType(kind.name, kind.rovers, kind.sectors * channels + calls, 2, self.config.skills)

    def reset(self, key: Key[Array, ""]) -> tuple[RoverState, Any]:
        state = draw_state(self.config, key)
        return state, self._observe(state, direction_of(state.heading))

    def step(self, state: RoverState, action: Any, key: Key[Array, ""]) -> tuple[RoverState, Any]:
        del key  # The domain is deterministic once drawn.
        return self._advance(state, self._of_all(action))

    def step_worlds(
        self, state: RoverState, action: Any, keys: Key[Array, " worlds"]
    ) -> tuple[RoverState, Any]:
        del keys
        return self._advance(state, self._of_all(action))

    def counterfactual(self, state: RoverState) -> Progress:
        """What is observed, and how near visits were where that counts."""
        return state.progress()

    def counterfactual_step(
        self,
        state: RoverState,
        other: Progress,
        action: Any,
        key: Key[Array, ""],
        copies: Int[Array, " agents"],
    ) -> tuple[Progress, Float[Array, ""]]:
        """See `OffersCounterfactuals`: a rover that is there three times counts as three at a POI."""
        del key
        there, _ = moved(self.config, state, self._of_all(action))
        poi_squared = self._poi_squared_distances(there)
        after = self._visited(there.with_progress(other), poi_squared, copies).progress()
        return after, rewards.team_reward(self.config, other, after)

    def _of_all(self, action: Any) -> Float[Array, "agents 2 *worlds"]:
        """All rovers' actions in one array."""
        return jnp.concatenate([action[kind.name] for kind in self.types]) if self.types else action

    def _by_type(self, of_types: Sequence[Array]) -> Any:
        """Each type's array by its name; where rovers are alike, the only one."""
        if not self.types:
            return of_types[0]
        return {kind.name: own for (kind, _), own in zip(self.crew, of_types, strict=True)}

    def central_state(self, state: RoverState) -> Float[Array, " features"]:
        """Where everything is, how rovers head, what is observed, and the time; then what options add.

        They add the courses of POIs, each type's place in the order, which rovers work, and how near each
        POI was visited.
        """
        options = (state.poi_direction, state.order, state.working(), state.closest)
        parts = (state.position, *direction_of(state.heading), state.poi_position, state.observed)
        time = state.time / self.episode_length
        return jnp.concatenate(
            [part.ravel().astype(jnp.float32) for part in (*parts, time, *options) if part is not None]
        )

    def scene(self, state: RoverState) -> Scene:
        """Rovers, POIs, and how near one has to come."""
        return scene(self.config, state)

    def _advance(
        self, state: RoverState, action: Float[Array, "agents 2 *worlds"]
    ) -> tuple[RoverState, TimeStep | TimeStepByType]:
        before = state.progress()
        state, direction = moved(self.config, state, action)
        poi_squared = self._poi_squared_distances(state)
        local_rewards = self._local_rewards(state, poi_squared)
        state = self._visited(state, poi_squared)
        terminated = rewards.task_done(self.config, state.progress())
        returned = TimeStepByType if self.types else TimeStep
        return state, returned(
            observation=self._observe(state, direction),
            local_rewards=self._by_type([local_rewards[rows] for _, rows in self.crew]),
            team_reward=rewards.team_reward(self.config, before, state.progress()),
            terminated=terminated,
            truncated=(state.time >= self.episode_length) & ~terminated,
        )

    def _visited(
        self,
        state: RoverState,
        poi_squared: Float[Array, "pois agents *worlds"],
        copies: Int[Array, " agents"] | None = None,
    ) -> RoverState:
        """The end of a step in which everything has moved: what the team has to show now, and the time."""
        config, working = self.config, state.working()
        if working is not None:
            poi_squared = jnp.where(working[None], poi_squared, jnp.inf)
        visited = coupling.visited(
            poi_squared,
            self._unlocked(state),
            config.group_indices,
            config.pois_per_type,
            self.crew,
            config.activation_distance,
            copies,
        )
        closest = state.closest
        if closest is not None:
            distance = coupling.visiting_distance(poi_squared, self.crew, copies)
            near = config.min_distance / jnp.maximum(distance, config.min_distance)
            closest = jnp.maximum(closest, jnp.where(visited, near, 0.0))
        progress = Progress(state.observed | visited, closest)
        return dataclasses.replace(state.with_progress(progress), time=state.time + 1)

    def _unlocked(self, state: RoverState) -> Bool[Array, "types *worlds"]:
        """The types whose turn it is, or was."""
        done = coupling.types_observed(state.observed, self.config.pois_per_type)
        if state.order is None:
            return coupling.unlocked_by_parents(done, self.config.parent_indices)
        return coupling.unlocked_in_order(done, state.order)

    def _poi_squared_distances(self, state: RoverState) -> Float[Array, "pois agents *worlds"]:
        squared = [_squared(*_offsets(state.position, poi)) for poi in state.poi_position]
        return jnp.stack(squared)

    def _local_rewards(
        self, state: RoverState, poi_squared: Float[Array, "pois agents *worlds"]
    ) -> Float[Array, "agents skills *worlds"]:
        """Closeness to the closest POI of each type and to the closest agent, and their negatives.

        A POI that is observed in this very step still counts, also where observed ones vanish.
        """
        config = self.config
        if config.observed_pois == "vanish":
            poi_squared = jnp.where(state.observed[:, None], jnp.inf, poi_squared)
        by_type = poi_squared.reshape(-1, config.pois_per_type, *poi_squared.shape[1:])
        nearest = [functools.reduce(jnp.minimum, list(pois)) for pois in by_type]
        if self.n_agents > 1:
            others = [self._squared_distance_to(state, other) for other in range(self.n_agents)]
            nearest.append(functools.reduce(jnp.minimum, others))
        closeness = [rewards.closeness(squared, config.activation_distance) for squared in nearest]
        return jnp.stack([sign * near for near in closeness for sign in (1, -1)], axis=1)

    def _squared_distance_to(self, state: RoverState, other: int) -> Float[Array, "agents *worlds"]:
        squared = _squared(*_offsets(state.position, state.position[other]))
        return jnp.where(self._meets(other, state), squared, jnp.inf)

    def _meets(self, other: int, state: RoverState) -> Bool[Array, "agents *ones"]:
        """Who meets one agent: all but itself, or nobody once it has broken down."""
        others = (jnp.arange(self.n_agents) != other).reshape(-1, *(1,) * state.time.ndim)
        working = state.working()
        return others if working is None else others & working[None, other]

    def _observe(self, state: RoverState, direction: Direction) -> Any:
        return self._by_type([self._sensed(kind, rows, state, direction) for kind, rows in self.crew])

    def _sensed(
        self, kind: RoverType, rows: slice, state: RoverState, direction: Direction
    ) -> Float[Array, "rovers obs *worlds"]:
        """What rovers of one type sense, sector by sector, and then the calls.

        In each sector there is one channel per type of rovers, then one per POI type.
        """
        config = self.config
        reflections = Reflections(
            (direction[0][rows], direction[1][rows]),
            kind.sectors,
            config.min_distance,
            kind.observation_radius,
            closest=config.sensor == "closest",
        )
        rovers = [self._rovers_around(rows, others, state) for _, others in self.crew]
        pois = [self._pois_around(rows, poi_type, state) for poi_type in range(config.n_poi_types)]
        channels = [reflections.channel(reflectors) for reflectors in (*rovers, *pois)]
        readings = [channel[q] for q in range(kind.sectors) for channel in channels]
        return jnp.stack([*readings, *self._calls(state, like=readings[0])], axis=1)

    def _names_of_sensed(self, kind: RoverType) -> tuple[str, ...]:
        """What each number is that `_sensed` gives; sectors by their bearings, for some have more of them."""
        rovers = [other.name for other, _ in self.crew] if self.config.rover_types else ["rovers"]
        names = [*rovers, *(f"POIs of type {name}" for name in self.config.type_names)]
        width = 360 // kind.sectors
        readings = [
            f"{name} at {sector * width} to {(sector + 1) * width} degrees"
            for sector in range(kind.sectors)
            for name in names
        ]
        drawn = self.config.order == "drawn"
        return (*readings, *(f"call for type {name}" for name in self.config.type_names if drawn))

    def _rovers_around(self, rows: slice, others: slice, state: RoverState) -> list[Reflector]:
        """All rovers of one type, to be sensed by those of another, or of the same one."""
        around = range(others.start, others.stop)
        if others == rows and len(around) == 1:
            return []
        position = state.position[rows]
        return [
            (*_offsets(position, state.position[other]), 1.0, self._meets(other, state)[rows])
            for other in around
        ]

    def _pois_around(self, rows: slice, poi_type: int, state: RoverState) -> list[Reflector]:
        config = self.config
        vanish = config.observed_pois == "vanish"
        first = poi_type * config.pois_per_type
        return [
            (
                *_offsets(state.position[rows], state.poi_position[poi]),
                config.values[poi_type],
                ~state.observed[None, poi] if vanish else None,
            )
            for poi in range(first, first + config.pois_per_type)
        ]

    def _calls(self, state: RoverState, like: Float[Array, "rovers *worlds"]) -> list[Array]:
        """What rovers hear of each type, if the order is drawn: 1 if it is the next, else 0."""
        if state.order is None:
            return []
        done = coupling.types_observed(state.observed, self.config.pois_per_type)
        is_next = coupling.next_in_order(done, state.order).astype(like.dtype)
        return [jnp.broadcast_to(calls, like.shape) for calls in is_next]


def _offsets(
    position: Float[Array, "agents 2 *worlds"], target: Float[Array, "2 *worlds"]
) -> tuple[Array, Array]:
    """From every rover to one target, along x and along y."""
    return target[None, 0] - position[:, 0], target[None, 1] - position[:, 1]


def _squared(dx: Array, dy: Array) -> Array:
    return dx * dx + dy * dy
