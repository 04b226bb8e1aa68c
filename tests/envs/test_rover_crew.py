"""Rovers that differ: what a POI takes of each type, who senses what, and what makes no crew.

Whole steps are compared with the oracle in test_rover_oracle.py.
"""

import dataclasses
import functools
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from oracles import refusals
from oracles.rover_scene import FAR, STAND, Scene, around
from skillcrew.envs.padded import uniform
from skillcrew.envs.rover import config as rover_config
from skillcrew.envs.rover import crew as rover_crew
from skillcrew.envs.rover.config import RoverConfig
from skillcrew.envs.rover.crew import RoverType
from skillcrew.envs.rover.world import RoverDomain
from skillcrew.errors import UserError

SCOUTS = RoverType("scout", 3, 2, max_turn=2.0, max_speed=1.5, sensor_resolution=180)
HAULERS = RoverType("hauler", 2, 1, max_speed=0.5, observation_radius=4.0)
KITE = RoverType("kite", 1, 0, max_speed=4.0, sensor_resolution=360)
A, A_TOO = (5.0, 5.0), (14.0, 5.0)
CREW = Scene(n_poi_types=1, pois_per_type=2, rover_types=(SCOUTS, HAULERS, KITE))
SKILLS = ("go_to_poi_A", "go_away_from_poi_A", "go_to_agent", "go_away_from_agent")
SIZES = {"scout": 2 * (3 + 1), "hauler": 4 * (3 + 1), "kite": 3 + 1}

refusal = functools.partial(refusals.refusal, refusals.unhooked(rover_crew).RoverType, name="scout")
UnhookedConfig = refusals.unhooked(rover_config).RoverConfig


def near(place: tuple[float, float], count: int) -> list[tuple[float, float]]:
    return [around(place, 70 * i, 1.5) for i in range(count)]


@pytest.mark.parametrize(
    "scouts, haulers, kites, seen",
    [(2, 1, 0, True), (3, 2, 1, True), (3, 0, 1, False), (1, 2, 1, False), (0, 0, 1, False)],
)
def test_a_poi_takes_as_many_of_each_type_as_the_type_says(scouts, haulers, kites, seen) -> None:
    counts = {SCOUTS: scouts, HAULERS: haulers, KITE: kites}
    rovers = [place for kind, n in counts.items() for place in near(A, n) + [FAR] * (kind.rovers - n)]
    after, step = CREW.step(CREW.state(rovers, [A, A_TOO]))
    assert after.observed.tolist() == [seen, False]
    assert bool(step.terminated) is seen


def test_all_types_must_be_at_the_same_poi() -> None:
    rovers = [*near(A, 2), FAR, *near(A_TOO, 2), FAR]
    after, _ = CREW.step(CREW.state(rovers, [A, A_TOO]))
    assert not after.observed.any()


def test_all_types_must_be_there_at_the_same_step() -> None:
    hauler = around(A, 180, 2.3)  # 0.5 m a step: there after one.
    rovers = [*near(A, 2), FAR, hauler, FAR, FAR]
    ahead = (0.0, 1.0)
    state, _ = CREW.step(CREW.state(rovers, [A, A_TOO], headings=[0, np.radians(70), 0, 0, 0, 0]))
    assert not state.observed.any()
    gone, _ = CREW.step(state, ahead, ahead, STAND, ahead, STAND, STAND)
    assert not gone.observed.any()
    here, _ = CREW.step(state, STAND, STAND, STAND, ahead, STAND, STAND)
    assert here.observed.tolist() == [True, False]


def test_observations_actions_and_rewards_come_by_type() -> None:
    env = CREW.env
    assert [(kind.name, kind.agents, kind.action_size) for kind in env.types] == [
        ("scout", 3, 2),
        ("hauler", 2, 2),
        ("kite", 1, 2),
    ]
    assert {kind.name: kind.observation_size for kind in env.types} == SIZES
    assert all(kind.skills == SKILLS for kind in env.types)
    assert env.skills[3:6] == ("scout/go_away_from_agent", "hauler/go_to_poi_A", "hauler/go_away_from_poi_A")
    state, seen = jax.eval_shape(env.reset, jax.random.key(0))
    action = {kind.name: jnp.zeros((kind.agents, 2)) for kind in env.types}
    after, step = jax.eval_shape(env.step, state, action, jax.random.key(0))
    assert after == state and seen == step.observation
    shapes = {name: leaf.shape for name, leaf in step.observation.items()}
    assert shapes == {kind.name: (kind.agents, SIZES[kind.name]) for kind in env.types}
    assert step.local_rewards["hauler"].shape == (2, 4)


def test_each_type_of_rovers_reflects_in_a_channel_of_its_own() -> None:
    rovers = [(5, 5), FAR, FAR, (5, 7), (2, 5), (9, 5)]
    _, step = CREW.step(CREW.state(rovers, [FAR, FAR]))
    # Two sectors: left and right of the heading, and dead ahead is left. Channels: scouts, haulers, kites, A.
    scout = np.asarray(step.observation[0, : SIZES["scout"]]).reshape(2, 4)
    np.testing.assert_allclose(scout[:, 1:3], [[1 / 4, 1 / 16], [1 / 9, 0]], rtol=1e-5)
    assert (scout[:, [0, 3]] < 1e-5).all()
    # The first hauler sees 4 m far: one scout below it, the other hauler 3.6 m away, and not the kite.
    hauler = np.asarray(step.observation[3, : SIZES["hauler"]]).reshape(4, 4)
    np.testing.assert_allclose(hauler.sum(0), [1 / 4, 1 / 13, 0, 0], rtol=1e-5)
    # What is alone of its type senses none of it.
    kite = np.asarray(step.observation[5, : SIZES["kite"]])
    np.testing.assert_allclose(kite, [1 / 16, 1 / 20 + 1 / 49, 0, 0], atol=1e-5)


def test_a_crew_of_one_type_is_a_team_whose_rovers_are_alike() -> None:
    own = dict(max_turn=1.0, max_speed=2.0, observation_radius=6.0, sensor_resolution=120)
    rules = dict(n_poi_types=2, world_size=6.0)
    alike = RoverDomain(RoverConfig(n_agents=3, spatial_coupling=2, **rules, **own))
    crew = RoverDomain(RoverConfig(rover_types=(RoverType("rover", 3, 2, **own),), **rules))
    key = jax.random.key(3)
    assert alike.observation_size == crew.observation_size

    def two_steps(env):
        state, seen = env.reset(key)
        action = jnp.array([[0.5, 0.1], [-0.3, 1.0], [0.9, -0.5]])
        state, _ = env.step(state, action, key)
        return seen, *env.step(state, -action, key)

    for ours, theirs in zip(
        *(jax.tree.leaves(jax.jit(two_steps, static_argnums=0)(env)) for env in (uniform(crew), alike)),
        strict=True,
    ):
        np.testing.assert_array_equal(ours, theirs)


def test_a_configuration_knows_its_rovers() -> None:
    config = RoverConfig(rover_types=(SCOUTS, HAULERS))
    assert config.n_agents == 5
    assert config == dataclasses.replace(config) == RoverConfig(n_agents=5, rover_types=(SCOUTS, HAULERS))
    assert config.summary().startswith(
        "3 scout + 2 hauler, 2 POI types, spatial coupling 2 scout + 1 hauler,"
    )


@pytest.mark.parametrize(
    "fields, said",
    [
        (dict(rovers=0), "rover type scout: rovers = 0: give a whole number of at least 1"),
        (dict(coupling=-1), "rover type scout: coupling = -1: give a whole number of at least 0"),
        (dict(coupling=3), "rover type scout: coupling = 3: above rovers = 2"),
        (dict(max_speed=0.0), "rover type scout: max_speed = 0.0: give a positive number"),
        (dict(max_turn=-1.0), "rover type scout: max_turn = -1.0: give a positive number"),
        (dict(observation_radius=0), "rover type scout: observation_radius = 0: give a positive number"),
        (
            dict(sensor_resolution=50),
            "rover type scout: sensor_resolution = 50: give whole degrees that divide",
        ),
    ],
)
def test_what_is_no_type_of_rovers_is_refused(fields: dict[str, Any], said: str) -> None:
    assert refusal(**{"rovers": 2, **fields}).startswith(said)


@pytest.mark.parametrize("name", ["", "a/b", "two words", 3])
def test_a_name_is_a_word(name: Any) -> None:
    with pytest.raises(UserError, match=f"rover type {name!r}: give a name of letters"):
        refusals.unhooked(rover_crew).RoverType(name, 1)


@pytest.mark.parametrize(
    "fields, said",
    [
        (dict(n_agents=4), "n_agents = 4: rover_types have 5 together; give 5 or leave it out"),
        (dict(spatial_coupling=2), "spatial_coupling = 2: not with rover_types, which say it; leave it out"),
        (dict(max_turn=1.0), "max_turn = 1.0: not with rover_types"),
        (dict(max_speed=2.0), "max_speed = 2.0: not with rover_types"),
        (dict(sensor_resolution=45), "sensor_resolution = 45: not with rover_types"),
        (dict(observation_radius=9.0), "observation_radius = 9.0: not with rover_types"),
        (dict(breakdowns=1), "breakdowns = 1: not with rover_types; leave it out"),
        (
            dict(simultaneous=(("A", "B"),)),
            "simultaneous = (('A', 'B'),): the largest group takes 4 of rover type scout at once, above",
        ),
        (
            dict(rover_types=(SCOUTS, HAULERS, SCOUTS)),
            "rover_types = scout, hauler, scout: scout is named twice",
        ),
        (dict(rover_types=(KITE,)), "rover_types = kite: coupling = 0 in all, so that a POI needs no rover"),
        (dict(rover_types=("scout",)), "rover_types = ('scout',): give a list of RoverType"),
    ],
)
def test_what_contradicts_the_types_is_refused(fields: dict[str, Any], said: str) -> None:
    message = refusals.refusal(UnhookedConfig, **{"rover_types": (SCOUTS, HAULERS), **fields})
    assert message.startswith(said)
