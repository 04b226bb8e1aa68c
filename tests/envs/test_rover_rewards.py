"""The rewards of the skills and of the team, and the two ways in which an episode ends."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from oracles import rover
from oracles.rover_cases import (
    CASES,
    NEVER,
    WORLDS,
    compiled_step,
    oracle_world,
    random_actions,
    random_states,
)
from oracles.rover_scene import AHEAD, FAR, STAND, Scene, around

HERE = (10.0, 10.0)
LONE = Scene(n_poi_types=3, pois_per_type=2)
TRIO = Scene(n_agents=3, n_poi_types=1, activation_distance=3.0)
VANISHING = Scene(n_poi_types=1, pois_per_type=2, observed_pois="vanish")
FRACTION = Scene(n_poi_types=4, parents={"C": ("A", "B")}, team_reward="fraction", episode_length=5)
SHARED = Scene(pois_per_type=2, team_reward="fraction")
PAIR = Scene(n_agents=2, n_poi_types=2, episode_length=4)
FRAIL = Scene(n_agents=3, n_poi_types=1, breakdowns=2)


def test_skills_are_named_by_type_and_agents_come_last() -> None:
    pois = ("go_to_poi_A", "go_away_from_poi_A", "go_to_poi_B", "go_away_from_poi_B")
    assert PAIR.env.skills == (*pois, "go_to_agent", "go_away_from_agent")
    assert LONE.env.skills == (*pois, "go_to_poi_C", "go_away_from_poi_C")


@pytest.mark.parametrize("distance, reward", [(0.0, 1.0), (1.0, 1.0), (2.0, 1.0), (4.0, 0.5), (20.0, 0.1)])
def test_go_to_pays_the_closeness_of_the_closest_poi(distance: float, reward: float) -> None:
    pois = [around(HERE, 10, distance + 3), around(HERE, 130, distance), FAR, FAR, HERE, FAR]
    _, step = LONE.step(LONE.state(HERE, pois))
    assert LONE.rewards(step, "go_to_poi_A") == pytest.approx([reward], rel=1e-5)
    assert LONE.rewards(step, "go_away_from_poi_A") == pytest.approx([-reward], rel=1e-5)
    assert LONE.rewards(step, "go_to_poi_C") == [1.0]


def test_go_to_agent_pays_the_closeness_of_the_closest_other() -> None:
    rovers = [HERE, around(HERE, 0, 4.0), around(HERE, 180, 12.0)]
    _, step = TRIO.step(TRIO.state(rovers, [FAR]))
    expected = [3 / 4, 3 / 4, 3 / 12]
    assert TRIO.rewards(step, "go_to_agent") == pytest.approx(expected, rel=1e-5)
    assert TRIO.rewards(step, "go_away_from_agent") == pytest.approx([-e for e in expected], rel=1e-5)


def test_local_rewards_are_those_of_the_place_after_the_move() -> None:
    _, step = TRIO.step(TRIO.state([HERE, FAR, FAR], [around(HERE, 0, 7.0)]), AHEAD, STAND, STAND)
    assert TRIO.rewards(step, "go_to_poi_A")[0] == pytest.approx(3 / 6, rel=1e-5)


def test_a_vanishing_poi_pays_in_the_step_in_which_it_is_observed_and_never_again() -> None:
    near, other = around(HERE, 90, 1.5), around(HERE, 0, 8.0)
    state = VANISHING.state(HERE, [near, other])
    state, step = VANISHING.step(state)
    assert VANISHING.rewards(step, "go_to_poi_A") == [1.0]
    _, step = VANISHING.step(state)
    assert VANISHING.rewards(step, "go_to_poi_A") == pytest.approx([2 / 8], rel=1e-5)
    assert VANISHING.rewards(step, "go_away_from_poi_A") == pytest.approx([-2 / 8], rel=1e-5)


def test_where_all_pois_of_a_type_vanished_nothing_is_paid() -> None:
    _, step = VANISHING.step(VANISHING.state(HERE, [HERE, HERE], observed=[True, True]))
    assert np.asarray(step.local_rewards).tolist() == [[0.0, 0.0]]


def test_an_observed_poi_that_persists_keeps_paying() -> None:
    _, step = LONE.step(LONE.state(HERE, [HERE, FAR, FAR, FAR, FAR, FAR], observed=[True] + [False] * 5))
    assert LONE.rewards(step, "go_to_poi_A") == [1.0]


def test_the_binary_reward_is_paid_once_for_the_last_type() -> None:
    state, paid, ended = PAIR.state([HERE, FAR], [HERE, HERE]), [], []
    for _ in range(3):
        state, step = PAIR.step(state)
        paid.append(float(step.team_reward))
        ended.append(bool(step.terminated))
    assert paid == [0.0, 1.0, 0.0]
    assert ended == [False, True, True]


def test_the_fraction_is_paid_for_each_newly_observed_type() -> None:
    state, paid = FRACTION.state(HERE, [HERE, HERE, HERE, FAR]), []
    for _ in range(3):
        state, step = FRACTION.step(state)
        paid.append(float(step.team_reward))
        assert not step.terminated
    assert paid == [2 / 4, 1 / 4, 0.0]


def test_a_second_poi_of_an_observed_type_pays_nothing() -> None:
    state = SHARED.state(HERE, [HERE, HERE, FAR, FAR], observed=[True, False, False, False])
    after, step = SHARED.step(state)
    assert after.observed.tolist() == [True, True, False, False]
    assert float(step.team_reward) == 0.0


def test_fractions_of_an_episode_add_up_to_the_share_observed() -> None:
    world, rng = oracle_world(**CASES["graph 120"]), np.random.default_rng(3)
    states, keys = random_states(world, rng), jax.random.split(jax.random.key(3), WORLDS)
    states = dataclasses.replace(states, observed=jnp.zeros_like(states.observed))
    paid = np.zeros(WORLDS)
    for _ in range(8):
        states, step = compiled_step("graph 120")(states, random_actions(world, rng), keys)
        paid += np.asarray(step.team_reward)
    done = [rover.types_observed(world, observed) for observed in np.asarray(states.observed).T]
    np.testing.assert_allclose(paid, np.mean(done, axis=1), atol=1e-6)
    assert len(set(paid.round(6).tolist())) > 2


def test_only_the_time_limit_truncates() -> None:
    state, flags = PAIR.state([HERE, HERE], [FAR, FAR]), []
    for _ in range(4):
        state, step = PAIR.step(state)
        flags.append((bool(step.terminated), bool(step.truncated)))
    assert flags == [(False, False)] * 3 + [(False, True)]


def test_a_task_done_in_the_last_step_is_terminated_and_not_truncated() -> None:
    state = PAIR.state([HERE, FAR], [FAR, HERE], observed=[True, False], time=3)
    after, step = PAIR.step(state)
    assert (bool(step.terminated), bool(step.truncated)) == (True, False)
    assert float(step.team_reward) == 1.0
    assert int(after.time) == 4


def test_the_last_observation_is_of_the_state_after_the_action() -> None:
    rovers, pois = [around(HERE, 180, 2.5), around(HERE, 80, 6.0)], [around(HERE, 200, 5.0), HERE]
    state = PAIR.state(rovers, pois, headings=[0.1, -2.0], observed=[True, False], time=2)
    after, step = PAIR.step(state, AHEAD, (0.3, 0.5))
    assert bool(step.terminated)
    expected = rover.observe(PAIR.world, PAIR.oracle_state(after))
    np.testing.assert_allclose(step.observation, expected, rtol=1e-4, atol=1e-6)
    assert (np.abs(np.asarray(after.position) - rovers).max(1) > 0.3).all()


def test_only_working_rovers_are_approached() -> None:
    rovers = [HERE, around(HERE, 0, 4.0), around(HERE, 180, 10.0)]
    state, paid = FRAIL.state(rovers, [FAR], breaks_at=[NEVER, 1, 2]), []
    for _ in range(3):
        state, step = FRAIL.step(state)
        paid.append(FRAIL.rewards(step, "go_to_agent"))
    np.testing.assert_allclose(
        paid, [[2 / 4, 2 / 4, 2 / 10], [2 / 10, 2 / 4, 2 / 10], [0, 2 / 4, 2 / 10]], rtol=1e-5
    )
