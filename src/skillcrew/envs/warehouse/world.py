"""The warehouse: a team that brings loads from shelves to stations, through a narrow corridor."""

import dataclasses
from collections.abc import Mapping

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, Key

from skillcrew.envs import carrying
from skillcrew.envs.environment import Environment, TimeStep
from skillcrew.envs.plane import Offset, offset
from skillcrew.envs.scene import Scene
from skillcrew.envs.warehouse.building import barred, in_corridor, moved, path_length
from skillcrew.envs.warehouse.config import WarehouseConfig
from skillcrew.envs.warehouse.presets import PRESETS
from skillcrew.envs.warehouse.scene import scene
from skillcrew.envs.warehouse.state import WarehouseState, draw_state


class WarehouseDomain(Environment):
    """Agents in two rooms, orders that come one after another, loads that it takes several agents to carry.

    Everything is drawn anew at every reset. An action drives along its direction, at full speed if it is of
    length 1 or more; entries beyond [-1, 1] are clipped.
    """

    name = "warehouse"
    success = "terminated"
    input_scaling = "symlog"
    config_class = WarehouseConfig
    presets = PRESETS
    action_size = 2

    def __init__(self, config: WarehouseConfig):
        self.config = config
        self.n_agents = config.n_agents
        self.observation_size = 3 + 4 * config.n_shelves + 3 * config.n_stations
        self.episode_length = config.episode_length
        self.skills = config.skills
        self.skill_texts: Mapping[str, str] = config.skill_texts

    def reset(self, key: Key[Array, ""]) -> tuple[WarehouseState, Float[Array, "agents obs"]]:
        state = draw_state(self.config, key)
        # Agents that start at a shelf to which an order comes at once lift its load right away.
        state = dataclasses.replace(state, held=self._lifted(state))
        return state, self._observe(state)

    def step(
        self, state: WarehouseState, action: Float[Array, "agents 2"], key: Key[Array, ""]
    ) -> tuple[WarehouseState, TimeStep]:
        del key  # The domain is deterministic once drawn.
        return self._advance(state, action)

    def step_worlds(
        self, state: WarehouseState, action: Float[Array, "agents 2 worlds"], keys: Key[Array, " worlds"]
    ) -> tuple[WarehouseState, TimeStep]:
        del keys
        return self._advance(state, action)

    def central_state(self, state: WarehouseState) -> Float[Array, " features"]:
        """Where everything is; of each order its shelf and station, whether it has come, and its bearers."""
        places = (state.position, state.gap, state.shelf, state.station, state.load)
        shelves = state.from_shelf[:, None] == jnp.arange(self.config.n_shelves)[None]
        stations = state.to_station[:, None] == jnp.arange(self.config.n_stations)[None]
        flags = (shelves, stations, self._come(state), state.held, state.delivered)
        return jnp.concatenate(
            [
                *(place.ravel() for place in places),
                *(flag.ravel().astype(jnp.float32) for flag in flags),
                state.time[None] / self.episode_length,
            ]
        )

    def scene(self, state: WarehouseState) -> Scene:
        """Agents, loads, shelves, stations and the wall."""
        return scene(self.config, state, self._come(state))

    def _advance(
        self, state: WarehouseState, action: Float[Array, "agents 2 *worlds"]
    ) -> tuple[WarehouseState, TimeStep]:
        after = self._moved(state, action)
        terminated = after.delivered.all(0)
        return after, TimeStep(
            observation=self._observe(after),
            local_rewards=self._local_rewards(after),
            team_reward=(terminated & ~state.delivered.all(0)).astype(jnp.float32),
            terminated=terminated,
            truncated=(after.time >= self.episode_length) & ~terminated,
        )

    def _moved(self, state: WarehouseState, action: Float[Array, "agents 2 *worlds"]) -> WarehouseState:
        """After everybody has moved, carried, let go, delivered and lifted."""
        config = self.config
        position = moved(config, state, action)
        team = jnp.ones(self.n_agents), config.coupling
        load = carrying.carried(state.load, state.held, position - state.position, *team)
        held = carrying.kept(state.held, _squared(position, load), config.reach, *team)
        station = _of_each(state.to_station, state.station)
        to_station = load - station
        there = held.any(1) & ((to_station * to_station).sum(1) <= config.station_radius**2)
        delivered = state.delivered | there
        held = held & ~delivered[:, None]
        lying = ~delivered & ~held.any(1)
        # What is dropped goes back to its shelf: it is to be found where orders say that it is.
        load = jnp.where(lying[:, None], _of_each(state.from_shelf, state.shelf), load)
        state = dataclasses.replace(
            state, position=position, load=load, held=held, delivered=delivered, time=state.time + 1
        )
        return dataclasses.replace(state, held=self._lifted(state))

    def _lifted(self, state: WarehouseState) -> carrying.Held:
        """Who holds what, once all who can have lifted."""
        return carrying.taken(
            state.held,
            _squared(state.position, state.load),
            self._come(state) & ~state.delivered,
            self.config.reach,
            jnp.ones(self.n_agents),
            self.config.coupling,
        )

    def _come(self, state: WarehouseState) -> Bool[Array, "orders *worlds"]:
        """Which orders have come."""
        return state.comes_at <= state.time[None]

    def _local_rewards(self, state: WarehouseState) -> Float[Array, "agents skills *worlds"]:
        """In the order of the skills' names."""
        config = self.config
        rewards = [
            full / jnp.maximum(path_length(config, state, place, side), full)
            for places, side, full in (
                (state.shelf, -1, config.reach),
                (state.station, 1, config.station_radius),
            )
            for place in places
        ]
        away = jnp.sqrt(_gap_offset(state).squared)
        return jnp.stack([*rewards, jnp.minimum(away / config.corridor_length, 1.0)], axis=1)

    def _observe(self, state: WarehouseState) -> Float[Array, "agents obs *worlds"]:
        """Offsets in metres along the building's axes; flags 0 or 1; hands at a shelf as a share."""
        config = self.config
        to_shelves = [offset(state.position, place) for place in state.shelf]
        to_stations = [offset(state.position, place) for place in state.station]
        lying = self._come(state) & ~state.delivered & ~state.held.any(1)
        waiting = [(lying & (state.from_shelf == shelf)).any(0) for shelf in range(config.n_shelves)]
        at = [(one.squared <= config.reach**2).sum(0, dtype=jnp.int32) for one in to_shelves]
        hands = [jnp.minimum(count / config.coupling, 1.0) for count in at]
        mine = [
            (state.held & (state.to_station == station)[:, None]).any(0)
            for station in range(config.n_stations)
        ]
        occupied = barred(state, in_corridor(config, state.position))
        gap = _gap_offset(state)
        places = [axis for one in (gap, *to_shelves, *to_stations) for axis in one]
        everyone = [
            jnp.broadcast_to(reading[None].astype(gap.dx.dtype), gap.dx.shape)
            for reading in (*waiting, *hands)
        ]
        own = [flag.astype(gap.dx.dtype) for flag in (*mine, occupied)]
        return jnp.stack([*places, *everyone, *own], axis=1)


def _gap_offset(state: WarehouseState) -> Offset:
    """Of the corridor's middle."""
    return offset(state.position, jnp.stack([jnp.zeros_like(state.gap), state.gap]))


def _squared(
    position: Float[Array, "agents 2 *worlds"], load: Float[Array, "orders 2 *worlds"]
) -> Float[Array, "orders agents *worlds"]:
    return jnp.stack([offset(position, one).squared for one in load])


def _of_each(
    index: Int[Array, "orders *worlds"], places: Float[Array, "places 2 *worlds"]
) -> Float[Array, "orders 2 *worlds"]:
    """The place that each order names."""
    picked = jnp.zeros_like(places, shape=(len(index), *places.shape[1:]))
    for number, place in enumerate(places):
        picked = jnp.where((index == number)[:, None], place[None], picked)
    return picked
