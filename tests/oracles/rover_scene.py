"""A Rover Domain in which a test puts everything in its place by hand."""

import math
from typing import Any

import jax
import numpy as np

from oracles import rover
from oracles.rover_cases import array, one_world, oracle_world
from skillcrew.envs.environment import TimeStep
from skillcrew.envs.padded import uniform
from skillcrew.envs.rover.config import RoverConfig
from skillcrew.envs.rover.world import RoverDomain, RoverState

STAND = (0.0, -1.0)
"""The action that neither turns nor drives."""
AHEAD = (0.0, 1.0)
"""The action that drives as far as possible along the heading."""
FAR = (900.0, 900.0)
"""A place from which nothing is near."""


class Scene:
    """One configuration, compiled once, however many states are put into it."""

    def __init__(self, **fields: Any):
        self.env = RoverDomain(RoverConfig(**fields))
        self.world: rover.World = oracle_world(**fields)
        self._step = jax.jit(uniform(self.env).step)

    def state(
        self,
        rovers: Any,
        pois: Any,
        headings: Any = None,
        observed: Any = None,
        time: int = 0,
        courses: Any = None,
        order: Any = None,
        breaks_at: Any = None,
        closest: Any = None,
    ) -> RoverState:
        """Everything in its place; `courses` in degrees, one a POI."""
        agents, n_pois = self.world.n_agents, self.world.n_pois
        visits = [0.0] * n_pois if closest is None else closest
        towards = None if courses is None else [around((0.0, 0.0), course, 1.0) for course in courses]
        return RoverState(
            position=array(np.reshape(rovers, (agents, 2)), "float32"),
            heading=array([0.0] * agents if headings is None else headings, "float32"),
            poi_position=array(np.reshape(pois, (n_pois, 2)), "float32"),
            observed=array([False] * n_pois if observed is None else observed, "bool"),
            time=array(time, "int32"),
            poi_direction=None if towards is None else array(towards, "float32"),
            order=None if order is None else array(order, "int32"),
            breaks_at=None if breaks_at is None else array(breaks_at, "int32"),
            closest=array(visits, "float32") if self.world.team_reward == "closest" else None,
        )

    def step(self, state: RoverState, *actions: tuple[float, float]) -> tuple[RoverState, TimeStep]:
        """One action per rover; every rover stands if none is given."""
        given = actions or (STAND,) * self.world.n_agents
        return self._step(state, array(given, "float32"), jax.random.key(0))

    def oracle_state(self, state: RoverState) -> rover.State:
        return one_world(self.world, jax.tree.map(lambda leaf: np.asarray(leaf)[..., None], state), 0)

    def sensed(self, state: RoverState, agent: int = 0) -> np.ndarray:
        """What one rover senses after a step in which all stood: sectors, channels."""
        return self._after_standing(state, agent)[0].reshape(self.world.n_sectors, -1)

    def heard(self, state: RoverState, agent: int = 0) -> list[float]:
        """What one rover hears of each type after such a step."""
        return self._after_standing(state, agent)[1].tolist()

    def _after_standing(self, state: RoverState, agent: int) -> tuple[np.ndarray, np.ndarray]:
        _, step = self.step(state)
        channels = self.world.n_sectors * (1 + self.world.n_types)
        return tuple(np.split(np.asarray(step.observation)[agent], [channels]))

    def rewards(self, step: TimeStep, skill: str) -> list[float]:
        """One reward per rover."""
        return np.asarray(step.local_rewards)[:, self.env.skills.index(skill)].tolist()


def around(place: tuple[float, float], degrees: float, distance: float) -> tuple[float, float]:
    """The place at a bearing, counter-clockwise from the x axis, and a distance in metres."""
    angle = math.radians(degrees)
    return place[0] + distance * math.cos(angle), place[1] + distance * math.sin(angle)
