"""Search and rescue and the warehouse by hand: a told team finishes, and what does not look does not."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from benchmarks import by_hand
from benchmarks.hand_rescue import assigned

import skillcrew as sc

EPISODES = 300
MEDIUM = ("rescue-v2-c2", "warehouse-o2-c2")


@pytest.mark.parametrize("name", MEDIUM)
def test_a_told_team_finishes(name: str) -> None:
    env = sc.make(name)
    assert float(by_hand.told(env, jax.random.key(1), EPISODES)) > 0.93


def test_what_does_not_look_does_not_finish() -> None:
    env = sc.make("rescue-v2-c2")
    assert float(by_hand.best_timetable(env, jax.random.key(2), True, 40, 30)) < 0.4


def test_a_timetable_that_does_the_right_thing_is_found_and_followed() -> None:
    """One shelf, one station and time to spare: nobody has to look."""
    env = sc.make("warehouse-o1-c2", n_shelves=1, n_stations=1, episode_length=70, latest_order=0)
    assert float(by_hand.best_timetable(env, jax.random.key(4), True, 40, 30)) > 0.9


def test_as_many_are_sent_as_it_takes_to_the_load_that_they_are_nearest_to() -> None:
    distance = jnp.array([[5.0, 1.0, 2.0, 9.0], [1.5, 9.0, 9.0, 4.0], [0.1, 0.1, 0.1, 0.1]])
    free = jnp.array([True, True, True, True])

    def sent(wanted, free=free, coupling=2):
        return assigned(distance, jnp.array(wanted), free, coupling).tolist()

    assert sent([True, True, False]) == [1, 0, 0, 1]
    assert sent([False, True, False]) == [1, -1, -1, 1]
    assert sent([True, True, False], coupling=3) == [0, 0, 0, -1]
    assert sent([True, True, False], free & jnp.array([True, False, True, True])) == [1, -1, -1, 1]
    assert sent([True, False, False], free & jnp.array([False, True, False, False])) == [-1] * 4


def test_each_agent_acts_by_what_it_chose() -> None:
    actions = jnp.asarray(np.random.default_rng(0).normal(size=(3, 2, 2, 5)))
    choice = jnp.asarray(np.random.default_rng(1).integers(0, 3, (2, 5)))
    acted = by_hand.chosen(actions, choice)
    for agent in range(2):
        for world in range(5):
            expected = actions[choice[agent, world], agent, :, world]
            np.testing.assert_array_equal(acted[agent, :, world], expected)
