"""The Rover Domain: a team of rovers that must observe POIs together, and in order."""

import dataclasses
import functools
from collections.abc import Mapping

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Key

from skillcrew.envs.environment import Environment, TimeStep
from skillcrew.envs.rover import coupling, rewards
from skillcrew.envs.rover.config import RoverConfig
from skillcrew.envs.rover.motion import Direction, direction_of, moved
from skillcrew.envs.rover.presets import PRESETS
from skillcrew.envs.rover.scene import scene, skill_texts
from skillcrew.envs.rover.sensors import Reflections
from skillcrew.envs.rover.state import RoverState, draw_state
from skillcrew.envs.scene import Scene


class RoverDomain(Environment):
    """Rovers with a turn and a drive each, in a square with POIs of several types.

    All positions are redrawn at every reset: rovers in the central 30 % of each axis with any
    heading, POIs anywhere in the square. The action's first entry turns by up to `max_turn`, its
    second drives 0 to `max_speed` along the new heading; entries beyond [-1, 1] are clipped.
    """

    name = "rover"
    success = "terminated"
    input_scaling = "sqrt"
    config_class = RoverConfig
    presets = PRESETS

    def __init__(self, config: RoverConfig):
        self.config = config
        self.n_agents = config.n_agents
        self.n_sectors = 360 // config.sensor_resolution
        calls = config.n_poi_types if config.order == "drawn" else 0
        self.observation_size = self.n_sectors * (1 + config.n_poi_types) + calls
        self.action_size = 2
        self.episode_length = config.episode_length
        self.skills = config.skills
        self.skill_texts: Mapping[str, str] = skill_texts(config)

    def reset(self, key: Key[Array, ""]) -> tuple[RoverState, Float[Array, "agents obs"]]:
        state = draw_state(self.config, key)
        return state, self._observe(state, direction_of(state.heading))

    def step(
        self, state: RoverState, action: Float[Array, "agents 2"], key: Key[Array, ""]
    ) -> tuple[RoverState, TimeStep]:
        del key  # The domain is deterministic once drawn.
        return self._advance(state, action)

    def step_worlds(
        self, state: RoverState, action: Float[Array, "agents 2 worlds"], keys: Key[Array, " worlds"]
    ) -> tuple[RoverState, TimeStep]:
        del keys
        return self._advance(state, action)

    def central_state(self, state: RoverState) -> Float[Array, " features"]:
        """Where everything is, how rovers head, what is observed, and the time; then what options add.

        They add the courses of POIs, each type's place in the order, and which rovers work.
        """
        options = (state.poi_direction, state.order, state.working())
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
    ) -> tuple[RoverState, TimeStep]:
        config = self.config
        state, direction = moved(config, state, action)
        poi_squared = self._poi_squared_distances(state)
        local_rewards = self._local_rewards(state, poi_squared)
        before = coupling.types_observed(state.observed, config.pois_per_type)
        observed = state.observed | self._newly_observed(state, poi_squared, before)
        after = coupling.types_observed(observed, config.pois_per_type)
        state = dataclasses.replace(state, observed=observed, time=state.time + 1)
        terminated = after.all(0)
        return state, TimeStep(
            observation=self._observe(state, direction),
            local_rewards=local_rewards,
            team_reward=rewards.team_reward(before, after, config.team_reward),
            terminated=terminated,
            truncated=(state.time >= config.episode_length) & ~terminated,
        )

    def _poi_squared_distances(self, state: RoverState) -> Float[Array, "pois agents *worlds"]:
        squared = [_squared(*_offsets(state.position, poi)) for poi in state.poi_position]
        return jnp.stack(squared)

    def _newly_observed(
        self,
        state: RoverState,
        poi_squared: Float[Array, "pois agents *worlds"],
        done: Bool[Array, "types *worlds"],
    ) -> Bool[Array, "pois *worlds"]:
        config, working = self.config, state.working()
        if working is not None:
            poi_squared = jnp.where(working[None], poi_squared, jnp.inf)
        if state.order is None:
            unlocked = coupling.unlocked_by_parents(done, config.parent_indices)
        else:
            unlocked = coupling.unlocked_in_order(done, state.order)
        return coupling.newly_observed(
            poi_squared,
            unlocked,
            config.group_indices,
            config.pois_per_type,
            config.spatial_coupling,
            config.activation_distance,
        )

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

    def _calls(self, state: RoverState, like: Float[Array, "agents *worlds"]) -> list[Array]:
        """What rovers hear of each type, if the order is drawn: 1 if it is the next, else 0."""
        if state.order is None:
            return []
        done = coupling.types_observed(state.observed, self.config.pois_per_type)
        is_next = coupling.next_in_order(done, state.order).astype(like.dtype)
        return [jnp.broadcast_to(calls, like.shape) for calls in is_next]

    def _observe(self, state: RoverState, direction: Direction) -> Float[Array, "agents obs *worlds"]:
        """Sector-major: for each sector the rover channel, then one channel per POI type; then the calls."""
        config = self.config
        reflections = Reflections(
            direction,
            self.n_sectors,
            config.min_distance,
            config.observation_radius,
            closest=config.sensor == "closest",
        )
        rovers = [
            (*_offsets(state.position, state.position[other]), 1.0, self._meets(other, state))
            for other in range(self.n_agents)
        ]
        channels = [reflections.channel(rovers if self.n_agents > 1 else [])]
        vanish = config.observed_pois == "vanish"
        for poi_type, value in enumerate(config.values):
            first = poi_type * config.pois_per_type
            channels.append(
                reflections.channel(
                    (
                        *_offsets(state.position, state.poi_position[poi]),
                        value,
                        ~state.observed[None, poi] if vanish else None,
                    )
                    for poi in range(first, first + config.pois_per_type)
                )
            )
        readings = [channel[q] for q in range(self.n_sectors) for channel in channels]
        return jnp.stack([*readings, *self._calls(state, like=readings[0])], axis=1)


def _offsets(
    position: Float[Array, "agents 2 *worlds"], target: Float[Array, "2 *worlds"]
) -> tuple[Array, Array]:
    """From every rover to one target, along x and along y."""
    return target[None, 0] - position[:, 0], target[None, 1] - position[:, 1]


def _squared(dx: Array, dy: Array) -> Array:
    return dx * dx + dy * dy
