"""Told teams: whom they send where, and that with good skills they finish."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from benchmarks.told import (
    GUESSING,
    SPLIT,
    TOGETHER,
    assigned,
    stages,
    targets,
    told_rollout,
    variants,
    wanted,
)

from oracles.analytic_skills import go_to_skills
from oracles.rover_cases import NEVER
from oracles.rover_scene import Scene
from skillcrew.envs.registry import make
from skillcrew.envs.rover.config import RoverConfig
from skillcrew.envs.rover.crew import RoverType, ranks
from skillcrew.envs.rover.world import RoverDomain

PAIRS = Scene(n_agents=5, n_poi_types=4, spatial_coupling=2, simultaneous=(("A", "B"), ("C", "D")))
CREW = (
    RoverType("scout", 4, 2, max_speed=1.5, sensor_resolution=45),
    RoverType("hauler", 2, 1, max_turn=1.5, observation_radius=11.0),
)
CORNERS = [(0.0, 0.0), (20.0, 0.0), (0.0, 20.0), (20.0, 20.0)]


def sent(scene: Scene, variant: str = TOGETHER, **state) -> str:
    """The type of each rover's target, POIs in the corners."""
    one = scene.state(pois=CORNERS, **state)
    choose = jax.jit(lambda states: targets(scene.env.config, states, variant))
    chosen = choose(jax.tree.map(lambda leaf: leaf[..., None], one))
    return "".join("ABCD"[kind] for kind in np.asarray(chosen)[:, 0])


@pytest.mark.parametrize(
    "distance, shares",
    [
        ([[1, 9], [2, 9], [9, 1], [9, 2]], [0, 0, 1, 1]),
        # All are closer to the first: those go on for which it matters least.
        ([[1, 2], [1, 9], [1, 3], [1, 8]], [1, 0, 1, 0]),
        # Of a type that must be filled up, the nearest; the spare one to where fewer are.
        ([[1, 9], [1, 9], [1, 7], [1, 5], [1, 8]], [0, 0, 1, 1, 0]),
        ([[1, 9], [2, 9], [3, 9], [9, 1], [9, 2], [9, 3]], [0, 0, 0, 1, 1, 1]),
    ],
)
def test_rovers_are_shared_out_by_what_they_have_to_go(distance, shares) -> None:
    distance = jnp.asarray(distance, jnp.float32)
    target = assigned(distance, jnp.ones(2, bool), jnp.ones(len(distance), bool), 2)
    assert target.tolist() == shares


def test_types_not_headed_for_get_nobody_and_broken_rovers_fill_no_place() -> None:
    distance = jnp.asarray([[1, 0, 9], [1, 0, 9], [6, 0, 5], [1, 0, 5], [2, 0, 6]], jnp.float32)
    working = jnp.array([False, True, True, True, True])
    target = assigned(distance, jnp.array([True, False, True]), working, 2)
    assert target[1:].tolist() == [0, 2, 0, 2]


@pytest.mark.parametrize("done, places", [("", "AABBA"), ("AB", "CCDDC")])
def test_a_group_is_shared_out_and_the_next_one_comes_after(done: str, places: str) -> None:
    rovers = [(1.0, 8.0), (2.0, 9.0), (19.0, 9.0), (18.0, 8.0), (5.0, 9.0)]
    assert sent(PAIRS, rovers=rovers, observed=[name in done for name in "ABCD"]) == places


def test_who_has_broken_down_is_replaced() -> None:
    frail = Scene(
        n_agents=3,
        n_poi_types=4,
        simultaneous=(("A", "B"),),
        breakdowns=1,
        parents={"C": ("A",), "D": ("C",)},
    )
    rovers = [(1.0, 0.0), (8.0, 0.0), (19.0, 0.0)]
    assert sent(frail, rovers=rovers, breaks_at=[NEVER] * 3, time=5)[::2] == "AB"
    assert sent(frail, rovers=rovers, breaks_at=[5, NEVER, NEVER], time=5)[1:] == "AB"


def test_a_split_team_sends_ahead_whom_it_can_spare() -> None:
    four = Scene(n_agents=4, n_poi_types=4, spatial_coupling=2, order="drawn", breakdowns=1)
    rovers = [(1.0, 1.0), (1.0, 2.0), (19.0, 1.0), (19.0, 2.0)]
    told = dict(rovers=rovers, order=[1, 0, 3, 2], breaks_at=[NEVER] * 4)
    assert sent(four, **told) == "BBBB"
    assert sent(four, SPLIT, **told) == "AABB"
    assert sent(four, SPLIT, **{**told, "observed": [False, True, False, False]})[:2] == "AA"
    assert sent(four, SPLIT, **{**told, "observed": [True, True, True, False]}) == "DDDD"
    # With one rover fewer there is none to spare.
    assert sent(four, SPLIT, **{**told, "breaks_at": [NEVER, NEVER, NEVER, 0]})[:3] == "BBB"


def test_a_guessing_team_sends_ahead_without_knowing_the_order() -> None:
    four = Scene(n_agents=4, n_poi_types=4, spatial_coupling=2, order="drawn")
    rovers = [(1.0, 1.0), (1.0, 2.0), (19.0, 1.0), (19.0, 2.0)]
    told = dict(rovers=rovers, order=[2, 0, 3, 1])
    # After B comes D, and C is last: nobody is sent to D, for nobody knows.
    assert sent(four, GUESSING, **told) == "AABB"
    assert sent(four, GUESSING, **{**told, "order": [3, 1, 2, 0]}) == "AADD"
    assert sent(four, GUESSING, **told, observed=[False, True, False, True]) == "AACC"
    assert sent(four, GUESSING, **told, observed=[True, True, False, True]) == "CCCC"


def test_parents_say_which_type_comes_next() -> None:
    scene = Scene(n_poi_types=3, parents={"A": ("C",), "B": ("A",)})
    one = scene.state(pois=CORNERS[:3], rovers=[(0.0, 0.0)])
    stage = stages(scene.env.config, jax.tree.map(lambda leaf: jnp.stack([leaf] * 2, axis=-1), one))
    assert stage.T.tolist() == [[1, 2, 0]] * 2
    done = jnp.array([[False, True], [False, False], [True, True]])
    working = jnp.ones((1, 2), bool)
    assert wanted(stage, done, working, ranks(scene.env.config.crew), TOGETHER).T.tolist() == [
        [True, False, False],
        [False, True, False],
    ]


@pytest.mark.parametrize(
    "name, further",
    [
        ("rover-t3-c3", (SPLIT,)),
        ("rover-t3-c2", (SPLIT,)),
        ("rover-t2-c2", ()),
        ("rover-t1-c3", ()),
        ("rover-t4-c3-simultaneous", ()),
        ("rover-t3-c3-drawn", (SPLIT, GUESSING)),
        ("rover-t2-crew", ()),
        ("rover-t3-crew", (SPLIT,)),
    ],
)
def test_only_teams_with_rovers_for_two_stages_can_split(name: str, further: tuple[str, ...]) -> None:
    assert variants(make(name).config) == (TOGETHER, *further)


@pytest.mark.parametrize(
    "variant, options",
    [
        (TOGETHER, dict(simultaneous=(("A", "B"),), breakdowns=1, n_agents=3)),
        (SPLIT, dict(order="drawn", poi_speed=0.2, n_agents=2)),
        (GUESSING, dict(order="drawn", n_agents=2)),
        (SPLIT, dict(rover_types=CREW)),
    ],
)
def test_with_good_skills_it_finishes(variant: str, options: dict) -> None:
    config = RoverConfig(n_poi_types=3, world_size=12.0, episode_length=60, **options)
    env = RoverDomain(config)
    skills, names = go_to_skills(env)
    rollout = jax.jit(lambda key: told_rollout.__wrapped__(env, skills, key, 100, variant, names))
    assert rollout(jax.random.key(0)) > 0.9
