"""Whole steps and resets of thousands of random worlds, compared with the oracle."""

import dataclasses

import jax
import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from oracles import rover
from oracles.rover_cases import (
    BORDER,
    CASES,
    WORLDS,
    Answers,
    answers,
    best_visits,
    compiled_reset,
    compiled_step,
    environment,
    gap_to_borders,
    one_world,
    oracle_world,
    random_actions,
    random_states,
)

STEPS = 2
RESETS = ["lone rover", "occluded 45", "vanish 180"]
"""Fewer than all, because a reset compiles slowly and senses as a step does."""
SEEDS = st.integers(0, 2**32 - 1)
# No seed is simpler than another: nothing to shrink.
PHASES = (Phase.explicit, Phase.reuse, Phase.generate)
# Sensed values and rewards are at most a few; float32 places in the square are exact to 1e-6 m.
CLOSE = dict(rtol=5e-5, atol=1e-5)


def assert_same_state(world: rover.World, said: Answers, after) -> None:
    kept = said.kept
    turned = np.asarray(after.heading)[:, kept] - said.of_after("heading")
    np.testing.assert_allclose(np.angle(np.exp(1j * turned)), 0, atol=2e-6, err_msg="heading")
    assert (
        np.abs(after.heading).max() <= np.pi + 1e-6
    )  # wrapped, so that it stays exact however often it turns
    np.testing.assert_allclose(
        after.position[..., kept], said.of_after("position"), **CLOSE, err_msg="position"
    )
    for field in ("poi_position", "poi_direction"):
        ours = getattr(after, field)
        if ours is not None:
            np.testing.assert_allclose(ours[..., kept], said.of_after(field), **CLOSE, err_msg=field)
    if after.closest is not None:
        ours = best_visits(world, after.closest)[..., kept]
        np.testing.assert_allclose(ours, said.of_after("best"), **CLOSE, err_msg="closest")
    for field in ("order", "breaks_at"):
        if getattr(after, field) is not None:
            np.testing.assert_array_equal(getattr(after, field)[..., kept], said.of_after(field))
    np.testing.assert_array_equal(after.observed[..., kept], said.of_after("observed"))
    np.testing.assert_array_equal(after.time[kept], said.of_after("time"))


def assert_same_outcome(said: Answers, step, skills: tuple[str, ...]) -> None:
    kept = said.kept
    for field in ("observation", "team_reward", "terminated", "truncated"):
        ours, theirs = np.asarray(getattr(step, field))[..., kept], said.of_outcome(field)
        np.testing.assert_allclose(ours, theirs, **CLOSE, err_msg=field)
    np.testing.assert_allclose(
        step.local_rewards[..., kept], said.local_rewards(skills), **CLOSE, err_msg="local"
    )


def share_observing(said: list[Answers]) -> float:
    """The share of steps in which a POI was newly observed."""
    fired = [(a.observed & ~b.observed).any() for s in said for b, a in zip(s.before, s.after, strict=True)]
    return float(np.mean(fired))


def share_withheld(world: rover.World, said: list[Answers]) -> float:
    """The share of steps in which enough rovers met at a POI whose parents were missing."""
    withheld = []
    for before, after in (
        (before, after) for s in said for before, after in zip(s.before, s.after, strict=True)
    ):
        state = dataclasses.replace(after, time=before.time)
        met = [rover.enough_near(world, state, poi) for poi in state.poi_position]
        withheld.append((np.array(met) & ~state.observed).any())
    return float(np.mean(withheld))


def share_where(said: list[Answers], field: str) -> float:
    return float(np.mean(np.concatenate([s.of_outcome(field) > 0 for s in said])))


@pytest.mark.parametrize("case", CASES)
@settings(max_examples=7, phases=PHASES)
@given(seed=SEEDS)
def test_steps_are_those_of_the_oracle(case: str, seed: int) -> None:
    world, env, rng = oracle_world(**CASES[case]), environment(case), np.random.default_rng(seed)
    states, keys = random_states(world, rng), jax.random.split(jax.random.key(seed), WORLDS)
    said: list[Answers] = []
    for _ in range(STEPS):
        actions = random_actions(world, rng)
        # In NumPy: JAX would compile each comparison of so many kept worlds.
        after, step = jax.device_get(compiled_step(case)(states, actions, keys))
        said.append(answers(world, states, actions))
        assert_same_state(world, said[-1], after)
        assert_same_outcome(said[-1], step, env.skills)
        states = after


@pytest.mark.parametrize("case", CASES)
def test_in_the_random_worlds_much_happens(case: str) -> None:
    """Agreement on worlds in which nothing is observed would say little."""
    world, rng = oracle_world(**CASES[case]), np.random.default_rng(1)
    said = [answers(world, random_states(world, rng), random_actions(world, rng)) for _ in range(2)]
    assert np.mean([s.kept.mean() for s in said]) > 0.95
    assert share_observing(said) > 0.2
    assert share_withheld(world, said) > 0.05
    assert share_where(said, "team_reward") > 0.05
    assert share_where(said, "terminated") > 0.2 or world.team_reward == "closest"
    assert share_where(said, "truncated") > 0.05


@pytest.mark.parametrize("case", RESETS)
@settings(max_examples=4, phases=PHASES)
@given(seed=SEEDS)
def test_resets_are_sensed_like_the_oracle_does(case: str, seed: int) -> None:
    world = oracle_world(**CASES[case])
    states, observation = compiled_reset(case)(jax.random.split(jax.random.key(seed), WORLDS))
    states = jax.device_get(states)
    drawn = [one_world(world, states, w) for w in range(WORLDS)]
    kept = [w for w in range(WORLDS) if gap_to_borders(world, drawn[w]) > BORDER]
    assert len(kept) > WORLDS // 2
    expected = np.stack([rover.observe(world, drawn[w]) for w in kept], axis=-1)
    np.testing.assert_allclose(np.asarray(observation)[..., kept], expected, **CLOSE)
