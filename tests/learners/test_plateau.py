"""When a skill stops learning, against a plain Python reading of the rule."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from skillcrew.learners.plateau import Plateau, PlateauConfig, gone_on, mean_return

GENERATIONS, SKILLS = 16, 3
# Halves and quarters only: every running average is exact, so that ties are ties for both.
CONFIG = PlateauConfig(window=3, earliest=6, tolerance=0.25, smoothing=0.5)


def stopping_generation(returns: list[float], config: PlateauConfig) -> int:
    """The generation, counted from 1, after `window` of which in a row brought no improvement; or -1.
    None before `earliest`."""
    smoothed = best = None
    waited = 0
    for generation, value in enumerate(returns, start=1):
        if smoothed is None:
            smoothed = best = value
            continue
        smoothed = config.smoothing * smoothed + (1 - config.smoothing) * value
        if smoothed > best + config.tolerance * abs(best):
            best, waited = smoothed, 0
        else:
            waited += 1
        if waited >= config.window and generation >= config.earliest and config.enabled:
            return generation
    return -1


def follow(config: PlateauConfig):
    """A compiled function from returns [generations, skills] to `stopped_at` after each generation."""

    def observe(plateau, inputs):
        plateau = plateau.observe(*inputs, config)
        return plateau, plateau.stopped_at

    generations = jnp.arange(1, GENERATIONS + 1, dtype=jnp.int32)
    return jax.jit(lambda returns: jax.lax.scan(observe, Plateau.create(SKILLS), (returns, generations))[1])


FOLLOW = follow(CONFIG)


@settings(max_examples=60)
@given(
    st.lists(
        st.lists(st.integers(-6, 6).map(float), min_size=SKILLS, max_size=SKILLS),
        min_size=GENERATIONS,
        max_size=GENERATIONS,
    )
)
def test_each_skill_stops_at_its_own_moment_for_good(returns: list[list[float]]) -> None:
    stopped_at = np.asarray(FOLLOW(jnp.array(returns)))
    for skill in range(SKILLS):
        moment = stopping_generation([row[skill] for row in returns], CONFIG)
        expected = [moment if 0 < moment <= now else -1 for now in range(1, GENERATIONS + 1)]
        assert stopped_at[:, skill].tolist() == expected


def test_whatever_still_improves_stops_at_the_latest() -> None:
    """The first never improves and stops by the rule, the second always does, the third begins too late."""
    returns = np.zeros((GENERATIONS, SKILLS))
    returns[:, 1] = 4.0 ** np.arange(GENERATIONS)
    returns[5:, 2] = 4.0 ** np.arange(GENERATIONS - 5)
    latest = follow(dataclasses.replace(CONFIG, latest=9))
    stopped_at = np.asarray(latest(jnp.asarray(returns, jnp.float32)))
    assert stopped_at[7].tolist() == [6, -1, -1]
    assert stopped_at[-1].tolist() == [6, 9, 9]
    assert np.asarray(FOLLOW(jnp.asarray(returns, jnp.float32)))[-1].tolist() == [6, -1, -1]


def test_improvement_after_the_stop_changes_nothing() -> None:
    returns = np.zeros((GENERATIONS, SKILLS))
    returns[6:] = 1000 * np.arange(1, 11)[:, None] ** 2
    stopped_at = np.asarray(FOLLOW(jnp.asarray(returns, jnp.float32)))
    assert stopped_at[-1].tolist() == [6] * SKILLS


def test_a_disabled_plateau_never_stops() -> None:
    stopped_at = follow(dataclasses.replace(CONFIG, enabled=False))(jnp.zeros((GENERATIONS, SKILLS)))
    assert (np.asarray(stopped_at) == -1).all()


def test_nothing_is_known_at_the_start_and_the_first_return_is_taken_as_it_is() -> None:
    start = Plateau.create(SKILLS)
    assert np.isneginf(start.smoothed).all()
    assert not start.stopped.any()
    after = start.observe(jnp.array([-7.0, 0.0, 3.0]), jnp.int32(1), CONFIG)
    assert after.smoothed.tolist() == after.best.tolist() == [-7, 0, 3]
    assert after.waited.tolist() == [0, 0, 0]


@pytest.mark.parametrize("agents", [(), (2,)])
def test_mean_return_is_the_double_sum(agents: tuple[int, ...]) -> None:
    time, episodes, discount = 6, 4, 0.7
    rng = np.random.default_rng(0)
    rewards = rng.normal(size=(time, episodes, *agents)).astype(np.float32)
    lengths = np.array([6, 1, 3, 5])
    lived = np.arange(time)[:, None] < lengths
    lived = np.broadcast_to(lived.reshape(time, episodes, *(1,) * len(agents)), rewards.shape)
    returns = []
    for index in np.ndindex(*rewards.shape[1:]):
        length = lengths[index[0]]
        for t in range(length):
            steps = range(t, length)
            returns.append(sum(discount ** (u - t) * float(rewards[(u, *index)]) for u in steps))
    # What was never lived must not count, whatever is written there.
    poisoned = jnp.asarray(np.where(lived, rewards, np.float32(1e6)))
    assert float(mean_return(poisoned, jnp.asarray(lived), discount)) == pytest.approx(
        np.mean(returns), rel=1e-5
    )


def test_mean_return_without_discount_is_the_mean_reward() -> None:
    rewards = jnp.array([[1.0, 2.0], [4.0, 9.0]])
    lived = jnp.array([[True, True], [True, False]])
    assert float(mean_return(rewards, lived, 0.0)) == pytest.approx(7 / 3)


def test_a_skill_that_finishes_the_task_is_worth_more_than_one_that_waits_outside_it() -> None:
    """Two teams on their way to a goal, paid min(1, 2 / distance): one arrives, one stops just short."""
    time = 50
    distance = np.maximum(12.0 - np.arange(time), 0.5)
    arriving, hovering = 2 / np.maximum(distance, 2), 2 / np.maximum(distance, 2.2)
    arrived = int(np.argmax(arriving == 1))
    rewards = jnp.asarray(np.stack([arriving, hovering], 1))
    mask = jnp.asarray(np.arange(time)[:, None] <= [arrived, time])
    terminated = jnp.zeros((time, 2), bool).at[arrived, 0].set(True)

    def return_of(world: int, rewards, mask) -> float:
        return float(mean_return(rewards[:, world], mask[:, world], 0.8))

    assert return_of(0, rewards, mask) < return_of(1, rewards, mask)
    went_on = gone_on(rewards, mask, terminated)
    assert return_of(0, *went_on) > return_of(1, *went_on)


def test_only_what_was_finished_goes_on_and_with_the_last_reward() -> None:
    """World 0 is done at step 1, world 1 ends there for lack of time, world 2 is done where it had ended."""
    rewards = jnp.arange(24.0).reshape(4, 3, 2)
    mask = jnp.array([[True] * 3, [True] * 3, [False] * 3, [False] * 3])
    terminated = jnp.zeros((4, 3), bool).at[1, 0].set(True).at[3, 2].set(True)
    paid, counts = gone_on(rewards, mask, terminated)
    assert counts.tolist() == [[True] * 3, [True] * 3, [True, False, False], [True, False, False]]
    np.testing.assert_array_equal(paid[:2], rewards[:2])
    np.testing.assert_array_equal(paid[2:, 0], np.broadcast_to(rewards[1, 0], (2, 2)))


def test_all_stop_at_once_and_those_that_had_stopped_keep_their_generation() -> None:
    plateau = dataclasses.replace(Plateau.create(3), stopped_at=jnp.array([-1, 4, -1], jnp.int32))
    assert plateau.stop_all(jnp.int32(9), jnp.array(True)).stopped_at.tolist() == [9, 4, 9]
    assert plateau.stop_all(jnp.int32(9), jnp.array(False)).stopped_at.tolist() == [-1, 4, -1]
