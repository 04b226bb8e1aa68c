"""The dense team rewards: what is paid for which POI and visit, and when an episode is over.

Single steps are compared with the oracle in test_rover_oracle.py, other teams in
test_rover_counterfactuals.py.
"""

import dataclasses
import functools
import itertools
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from oracles import rover
from oracles.checking import complaints
from oracles.rover_cases import (
    CASES,
    NEVER,
    WORLDS,
    best_visits,
    compiled_reset,
    compiled_step,
    one_world,
    oracle_world,
    random_actions,
    random_states,
)
from oracles.rover_scene import AHEAD, FAR, STAND, Scene, around
from skillcrew.envs.padded import uniform
from skillcrew.envs.registry import make
from skillcrew.envs.rover.config import RoverConfig
from skillcrew.envs.rover.crew import RoverType

HERE, THERE = (6.0, 10.0), (14.0, 10.0)
VALUE = Scene(n_poi_types=2, pois_per_type=2, poi_values=(1.0, 3.0), team_reward="value", episode_length=4)
CLOSEST = functools.partial(Scene, team_reward="closest", activation_distance=4.0)
THREES = CLOSEST(n_agents=5, n_poi_types=1, pois_per_type=2, spatial_coupling=3, breakdowns=2)
CHAIN = CLOSEST(n_agents=1, n_poi_types=2, poi_values=(1.0, 3.0), episode_length=6)
SCOUTS, HAULERS = RoverType("scout", 3, 2), RoverType("hauler", 2, 1)
CREW = CLOSEST(n_poi_types=1, rover_types=(SCOUTS, RoverType("kite", 1, 0), HAULERS))


def at(*distances: float) -> list[tuple[float, float]]:
    """Rovers so far from HERE, in different directions."""
    return [around(HERE, 70 * place, distance) for place, distance in enumerate(distances)]


def paid(scene: Scene, *arguments: Any, **fields: Any) -> float:
    """For a step in which all stand."""
    return float(scene.step(scene.state(*arguments, **fields))[1].team_reward)


def test_each_poi_pays_its_share_of_the_value_and_all_of_them_are_the_task() -> None:
    state, said = VALUE.state(HERE, [HERE, FAR, HERE, around(HERE, 0, 2.5)]), []
    for action in (STAND, STAND, AHEAD):
        state, step = VALUE.step(state, action)
        said.append((float(step.team_reward), bool(step.terminated), bool(step.truncated)))
    assert said == [(1 / 8, False, False), (3 / 8, False, False), (3 / 8, False, False)]
    assert state.observed.tolist() == [True, False, True, True], "of each type one, and it goes on"
    state = dataclasses.replace(state, poi_position=state.poi_position.at[1].set(jnp.asarray(HERE)))
    _, step = VALUE.step(state)
    assert (float(step.team_reward), bool(step.terminated), bool(step.truncated)) == (1 / 8, True, False)


def test_an_observed_poi_pays_no_more() -> None:
    assert paid(VALUE, HERE, [HERE, FAR, FAR, FAR], observed=[True, False, False, False]) == 0.0


@pytest.mark.parametrize(
    "distances, share",
    [
        ((2.0, 3.0, 3.7, 9.0, 9.0), 1 / 2.9),
        # Of five the three closest count, whoever they are.
        ((3.9, 1.0, 3.5, 1.5, 2.0), 1 / 1.5),
        ((1.5, 1.5, 1.5, 1.5, 1.5), 1 / 1.5),
        # The bound holds for the mean, not for each of them.
        ((0.0, 0.5, 3.5, 9.0, 9.0), 1 / (4 / 3)),
        ((0.0, 0.2, 0.3, 3.0, 3.0), 1.0),
        # All that are needed have to be near.
        ((0.0, 0.0, 4.1, 9.0, 9.0), 0.0),
    ],
)
def test_a_visit_pays_value_over_the_mean_distance_of_the_closest(distances: Any, share: float) -> None:
    sound = [NEVER] * 5
    assert paid(THREES, at(*distances), [HERE, FAR], breaks_at=sound) == pytest.approx(share / 2, rel=1e-5)


def test_of_rovers_at_the_same_place_no_more_than_needed_count() -> None:
    said = paid(THREES, at(1.5) * 5, [HERE, FAR], breaks_at=[NEVER] * 5)
    assert said == pytest.approx(1 / 1.5 / 2, rel=1e-5)


def test_who_has_broken_down_is_not_among_the_closest() -> None:
    rovers, breaks_at = at(0.0, 1.0, 2.0, 3.0, 4.0), [NEVER, 2, NEVER, NEVER, NEVER]
    for time, mean in ((1, 1.0), (2, 5 / 3)):
        said = paid(THREES, rovers, [HERE, FAR], breaks_at=breaks_at, time=time)
        assert said == pytest.approx(1 / mean / 2, rel=1e-5)
    assert paid(THREES, rovers, [HERE, FAR], breaks_at=[0, 0, 0, NEVER, NEVER]) == 0.0


def test_of_each_type_of_rovers_the_closest_count() -> None:
    # Scouts at 1, 3 and 2 m, the kite at 0.1 m, which is not needed, haulers at 3.5 and 3 m.
    said = paid(CREW, at(1.0, 3.0, 2.0, 0.1, 3.5, 3.0), [HERE])
    assert said == pytest.approx(1 / ((1 + 2 + 3) / 3), rel=1e-5)


def test_only_what_is_closer_than_ever_before_pays_more() -> None:
    # Drives from 3.5 m past the POI, and by 1.5 m beyond: 2.5, 1.5, 0.5, 0.5, 1.5.
    state, said = CHAIN.state(around(HERE, 180, 3.5), [HERE, FAR]), []
    for _ in range(5):
        state, step = CHAIN.step(state, AHEAD)
        said.append(float(step.team_reward))
    expected = [1 / 2.5, 1 / 1.5 - 1 / 2.5, 1 - 1 / 1.5, 0.0, 0.0]
    np.testing.assert_allclose(said, np.array(expected) / 4, atol=1e-6)


def test_a_visit_before_its_turn_counts_for_nothing() -> None:
    state, said = CHAIN.state(HERE, [around(HERE, 0, 4.5), HERE]), []
    for action in (STAND, AHEAD, STAND):
        state, step = CHAIN.step(state, action)
        said.append(float(step.team_reward))
    # At B all the while, with A still locked; then 3.5 m from A; and B counts from 1 m, its turn having come.
    np.testing.assert_allclose(said, [0.0, 1 / 3.5 / 4, 3 / 4], atol=1e-6)


def test_types_of_a_group_are_visited_together() -> None:
    scene = CLOSEST(n_agents=2, n_poi_types=2, simultaneous=(("A", "B"),))
    apart, met = [around(HERE, 0, 2.0), FAR], [around(HERE, 0, 2.0), around(THERE, 0, 4.0)]
    assert paid(scene, apart, [HERE, THERE], observed=[True, True]) == 0.0
    assert paid(scene, met, [HERE, THERE]) == pytest.approx((1 / 2 + 1 / 4) / 2, rel=1e-5)


def test_a_bound_beyond_the_activation_distance_pays_all_at_once() -> None:
    scene = CLOSEST(n_poi_types=1, min_distance=5.0)
    state, step = scene.step(scene.state(around(HERE, 0, 3.9), [HERE]))
    assert float(step.team_reward) == 1.0
    assert float(scene.step(scene.state(around(HERE, 0, 4.1), [HERE]))[1].team_reward) == 0.0
    state, step = scene.step(dataclasses.replace(state, position=jnp.asarray([HERE])))
    assert float(step.team_reward) == 0.0


def test_closest_visits_end_with_the_time_alone() -> None:
    state, flags = CHAIN.state(HERE, [HERE, HERE], observed=[True, True], closest=[1.0, 1.0], time=3), []
    for _ in range(3):
        state, step = CHAIN.step(state)
        flags.append((bool(step.terminated), bool(step.truncated), float(step.team_reward)))
    assert flags == [(False, False, 0.0)] * 2 + [(False, True, 0.0)]


def test_success_is_said_where_the_task_can_be_done() -> None:
    assert VALUE.env.success == make("rover-t2-c2").success == "terminated"
    assert CHAIN.env.success is None and uniform(CREW.env).success is None


@pytest.mark.parametrize(
    "copies, distances",
    [
        ((1, 1, 1, 1, 1), (1.0, 2.0, 3.0)),
        ((0, 1, 1, 1, 1), (2.0, 3.0, 3.5)),
        ((2, 1, 1, 1, 1), (1.0, 1.0, 2.0)),
        ((1, 3, 1, 1, 1), (1.0, 2.0, 2.0)),
        ((9, 1, 1, 1, 1), (1.0, 1.0, 1.0)),
        ((0, 0, 3, 1, 1), (3.0, 3.0, 3.0)),
        ((1, 1, 0, 0, 0), ()),
    ],
)
def test_a_rover_that_is_there_several_times_is_as_many_of_the_closest(copies: Any, distances: Any) -> None:
    state = THREES.state(at(1.0, 2.0, 3.0, 3.5, 9.0), [HERE, FAR], breaks_at=[NEVER] * 5)
    step, standing = jax.jit(THREES.env.counterfactual_step), jnp.asarray([STAND] * 5)
    begun = THREES.env.counterfactual(state)
    other, reward = step(state, begun, standing, jax.random.key(0), jnp.asarray(copies, jnp.int32))
    share = len(distances) / sum(distances) if distances else 0.0
    np.testing.assert_allclose(reward, share / 2, rtol=1e-5)
    np.testing.assert_allclose(other.closest, [share, 0.0], rtol=1e-5)


def lived(case: str, steps: int) -> tuple[list, np.ndarray]:
    """Worlds from their beginning on, world axis last; and what each team is paid in all."""
    world, rng = oracle_world(**CASES[case]), np.random.default_rng(8)
    state, keys = random_states(world, rng), jax.random.split(jax.random.key(8), WORLDS)
    blank = compiled_reset(case)(keys)[0]
    state = dataclasses.replace(state, observed=blank.observed, closest=blank.closest, time=blank.time)
    states, total = [state], np.zeros(WORLDS)
    for _ in range(steps):
        state, step = compiled_step(case)(state, random_actions(world, rng), keys)
        states.append(state)
        total += np.asarray(step.team_reward, np.float64)
        assert (np.asarray(step.team_reward) >= 0).all()
    return states, total


@pytest.mark.parametrize("case", ["closest", "closest of groups", "closest alone", "closest of a crew"])
def test_over_an_episode_the_best_visit_of_each_poi_is_paid(case: str) -> None:
    world = oracle_world(**CASES[case])
    states, total = lived(case, 10)
    most = sum(value / world.min_distance for value in world.poi_values)
    for w in range(WORLDS):
        best = [0.0] * world.n_pois
        for before, after in itertools.pairwise(states):
            there = dataclasses.replace(
                one_world(world, after, w), observed=np.asarray(before.observed)[:, w]
            )
            there.time -= 1
            for poi in np.flatnonzero(rover.visited_now(world, there)):
                best[poi] = max(best[poi], rover.value_over_distance(world, there, poi))
        np.testing.assert_allclose(total[w], sum(best) / most, atol=1e-5)
        np.testing.assert_allclose(best_visits(world, states[-1].closest)[:, w], best, rtol=1e-4, atol=1e-5)
    assert total.max() <= 1 + 1e-6
    assert len(set(total.round(4).tolist())) > WORLDS / 4


def test_over_an_episode_the_value_of_what_is_observed_is_paid() -> None:
    world = oracle_world(**CASES["value"])
    states, total = lived("value", 8)
    values = np.array(world.poi_values)
    np.testing.assert_allclose(total, values @ np.asarray(states[-1].observed) / values.sum(), atol=1e-6)
    assert total.max() <= 1 + 1e-6 and len(set(total.round(4).tolist())) > 8


def test_an_episode_starts_without_a_visit_and_other_rewards_remember_none() -> None:
    assert np.asarray(jax.jit(CHAIN.env.reset)(jax.random.key(0))[0].closest).tolist() == [0.0, 0.0]
    state, _ = jax.jit(VALUE.env.reset)(jax.random.key(0))
    assert state.closest is None and VALUE.env.counterfactual(state).closest is None


@pytest.mark.parametrize("name", ["rover-p4-c3-value", "rover-p4-c3-closest"])
def test_the_presets_are_sound(name: str) -> None:
    assert complaints(make(name)) == []


def test_a_configuration_says_what_it_is_paid_by() -> None:
    assert make("rover-p4-c1-closest").config.summary() == (
        "6 rover(s), 1 POI types, spatial coupling 1, 50 steps, 4 POIs of each, closest visits are paid"
    )
    assert RoverConfig(team_reward="value").summary().endswith("50 steps, value observed is paid")
    assert "paid" not in RoverConfig(team_reward="fraction").summary()
