"""The Rover Domain as an `Environment`: draws, shapes, purity, and what jax makes of it."""

import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from oracles.rover_cases import (
    CASES,
    NEVER,
    WORLDS,
    compiled_reset,
    compiled_step,
    environment,
    oracle_world,
    random_actions,
    random_states,
)
from oracles.rover_scene import Scene

FEATURES = [
    *("lone rover", "vanish 180", "vanish occluded 360", "drawn persisting", "crew drawn"),
    *("value of groups", "closest", "closest of a crew"),
]
TINY = Scene(n_agents=2, n_poi_types=1, sensor_resolution=360)
DRAWN = Scene(n_agents=3, n_poi_types=1, pois_per_type=2, world_size=10.0)
OPTIONS = Scene(n_agents=3, n_poi_types=3, order="drawn", poi_speed=0.5, breakdowns=2, episode_length=10)


def assert_close_trees(one, other) -> None:
    assert jax.tree.structure(one) == jax.tree.structure(other)
    for a, b in zip(jax.tree.leaves(one), jax.tree.leaves(other), strict=True):
        assert a.dtype == b.dtype
        np.testing.assert_allclose(np.asarray(a), np.asarray(b), rtol=2e-5, atol=1e-5)


def keys_of(seed: int, worlds: int):
    return jax.random.split(jax.random.key(seed), worlds)


@pytest.mark.parametrize("case", FEATURES)
def test_many_worlds_step_like_each_of_them(case: str) -> None:
    world, env, rng = oracle_world(**CASES[case]), environment(case), np.random.default_rng(5)
    states, actions = random_states(world, rng), random_actions(world, rng)
    one_by_one = jax.jit(jax.vmap(env.step, in_axes=(-1, -1, 0), out_axes=-1))
    together = compiled_step(case)(states, actions, keys_of(5, WORLDS))
    assert together[1].observation.shape == (env.n_agents, env.observation_size, WORLDS)
    assert_close_trees(together, one_by_one(states, actions, keys_of(5, WORLDS)))


@pytest.mark.parametrize("case", ["lone rover", "vanish 180"])
def test_many_worlds_reset_like_each_of_them(case: str) -> None:
    reset, keys = jax.jit(environment(case).reset), keys_of(6, WORLDS)
    together = compiled_reset(case)(keys)
    for w in (0, 7, WORLDS - 1):
        assert_close_trees(jax.tree.map(lambda leaf, w=w: leaf[..., w], together), reset(keys[w]))


@pytest.mark.parametrize("case", CASES)
def test_sizes_and_names_are_those_of_the_arrays(case: str) -> None:
    env, world = environment(case), oracle_world(**CASES[case])
    state, observation = jax.eval_shape(env.reset, jax.random.key(0))
    after, step = jax.eval_shape(
        env.step, state, jnp.zeros((env.n_agents, env.action_size)), jax.random.key(0)
    )
    assert after == state
    assert (env.n_agents, env.episode_length) == (world.n_agents, world.episode_length)
    calls = world.n_types if world.order_drawn else 0
    channels = max(1, len(world.kinds)) + world.n_types
    sectors = max(world.of(agent).n_sectors for agent in range(world.n_agents))
    assert observation.shape == (world.n_agents, sectors * channels + calls)
    assert step.observation.shape == observation.shape == (env.n_agents, env.observation_size)
    assert step.local_rewards.shape == (world.n_agents, len(env.skills))
    assert (step.team_reward.shape, step.terminated.shape, step.truncated.shape) == ((), (), ())
    assert (step.terminated.dtype, step.truncated.dtype) == (bool, bool)


@pytest.fixture(scope="module")
def draws():
    """The states of four thousand resets, world axis last."""
    return jax.jit(jax.vmap(lambda key: DRAWN.env.reset(key)[0], out_axes=-1))(keys_of(1, 4000))


def assert_uniform(drawn, low: float, high: float) -> None:
    """All within the interval, and each eighth of it about equally full, for every leading index."""
    drawn = np.asarray(drawn).reshape(-1, drawn.shape[-1])
    assert low <= drawn.min()
    assert drawn.max() <= high
    for row in drawn:
        share = np.histogram(row, bins=8, range=(low, high))[0] / len(row)
        np.testing.assert_allclose(share, 1 / 8, atol=0.03)


def test_rovers_start_in_the_central_third_and_pois_anywhere(draws) -> None:
    assert_uniform(draws.position, 3.5, 6.5)
    assert_uniform(draws.poi_position, 0.0, 10.0)
    assert_uniform(draws.heading, -np.pi, np.pi)


def test_everything_is_drawn_apart_from_everything_else(draws) -> None:
    leaves = [
        np.asarray(leaf).reshape(-1, 4000) for leaf in (draws.position, draws.poi_position, draws.heading)
    ]
    related = np.corrcoef(np.concatenate(leaves)) - np.eye(3 * 2 + 2 * 2 + 3)
    assert np.abs(related).max() < 0.1


def test_every_reset_draws_everything_anew(draws) -> None:
    for leaf in (draws.position, draws.poi_position, draws.heading):
        assert len(np.unique(np.asarray(leaf)[0], axis=-1).T) > 3900


def test_an_episode_starts_with_nothing_observed(draws) -> None:
    assert not np.asarray(draws.observed).any()
    assert not np.asarray(draws.time).any()


def test_a_world_without_options_is_drawn_as_it_always_was() -> None:
    """Results measured before an option existed stay what they were."""
    state, _ = jax.jit(DRAWN.env.reset)(jax.random.key(9))
    draw = jax.random.uniform(jax.random.key(9), (13,))
    np.testing.assert_allclose(state.position.ravel(), 3.5 + 3.0 * draw[:6], rtol=1e-5)
    np.testing.assert_allclose(state.heading, np.pi * (2 * draw[6:9] - 1), rtol=1e-5)
    np.testing.assert_allclose(state.poi_position.ravel(), 10.0 * draw[9:], rtol=1e-5)
    assert (state.poi_direction, state.order, state.breaks_at, state.closest) == (None,) * 4


@pytest.fixture(scope="module")
def optional_draws():
    """As `draws`, with every option that draws something."""
    return jax.jit(jax.vmap(lambda key: OPTIONS.env.reset(key)[0], out_axes=-1))(keys_of(2, 4000))


def test_every_order_is_as_likely(optional_draws) -> None:
    orders, counts = np.unique(np.asarray(optional_draws.order).T, axis=0, return_counts=True)
    assert sorted(map(tuple, orders.tolist())) == sorted(itertools.permutations(range(3)))
    np.testing.assert_allclose(counts / 4000, 1 / 6, atol=0.03)


def test_pois_set_out_in_every_direction(optional_draws) -> None:
    courses = np.asarray(optional_draws.poi_direction)
    np.testing.assert_allclose(np.hypot(courses[:, 0], courses[:, 1]), 1.0, rtol=1e-5)
    assert_uniform(np.arctan2(courses[:, 1], courses[:, 0]), -np.pi, np.pi)


def test_so_many_rovers_break_down_each_at_any_step(optional_draws) -> None:
    breaks_at = np.asarray(optional_draws.breaks_at)
    broken = breaks_at != NEVER
    assert (broken.sum(0) == 2).all()
    np.testing.assert_allclose(broken.mean(1), 2 / 3, atol=0.03)
    for rover in range(3):
        steps, counts = np.unique(breaks_at[rover, broken[rover]], return_counts=True)
        assert steps.tolist() == list(range(10))
        np.testing.assert_allclose(counts / broken[rover].sum(), 1 / 10, atol=0.02)
    first, second = breaks_at[:2, broken[:2].all(0)]
    assert abs(np.corrcoef(first, second)[0, 1]) < 0.1


def test_options_are_drawn_apart_from_everything_else(optional_draws) -> None:
    courses = np.arctan2(optional_draws.poi_direction[:, 1], optional_draws.poi_direction[:, 0])
    steps = np.where(optional_draws.breaks_at == NEVER, 4.5, optional_draws.breaks_at)
    drawn = (optional_draws.position, optional_draws.poi_position, optional_draws.heading, courses)
    rows = [np.asarray(leaf).reshape(-1, 4000) for leaf in (*drawn, steps, optional_draws.order)]
    related = np.corrcoef(np.concatenate(rows)) - np.eye(6 + 6 + 3 + 3 + 3 + 3)
    of_order = related[-3:, -3:]
    np.testing.assert_allclose(of_order[~np.eye(3, dtype=bool)], -1 / 2, atol=0.1)
    related[-3:, -3:] = 0
    assert np.abs(related).max() < 0.1


def test_the_same_key_draws_the_same_world() -> None:
    reset = jax.jit(DRAWN.env.reset)
    assert_close_trees(reset(jax.random.key(4)), reset(jax.random.key(4)))
    assert not np.allclose(reset(jax.random.key(4))[0].position, reset(jax.random.key(5))[0].position)


def test_a_step_depends_on_the_state_and_the_action_alone() -> None:
    state = TINY.state([(5.0, 5.0), (4.0, 6.0)], [(1.0, 2.0)])
    step, action = jax.jit(TINY.env.step), jnp.full((2, 2), 0.5)
    first = step(state, action, jax.random.key(0))
    assert_close_trees(first, step(state, action, jax.random.key(1)))


def test_an_action_beyond_its_range_is_the_nearest_within() -> None:
    state = TINY.state([(5.0, 5.0), (4.0, 6.0)], [(1.0, 2.0)], headings=[0.5, -2.0])
    for beyond, within in [((0.3, 7.0), (0.3, 1.0)), ((0.3, -7.0), (0.3, -1.0)), ((1.4, 0.0), (1.0, 0.0))]:
        assert_close_trees(TINY.step(state, beyond, beyond), TINY.step(state, within, within))


def counting(function, calls: list[int]):
    def counted(*arguments):
        calls.append(1)
        return function(*arguments)

    return jax.jit(counted)


def test_an_episode_is_traced_once() -> None:
    traces: list[int] = []
    step = counting(TINY.env.step, traces)
    state, _ = TINY.env.reset(jax.random.key(0))
    for seed in range(3):
        action = jax.random.uniform(jax.random.key(seed), (2, 2))
        state, _ = step(state, action, jax.random.key(seed))
    assert len(traces) == 1


def test_many_worlds_are_traced_once() -> None:
    traces: list[int] = []
    step = counting(TINY.env.step_worlds, traces)
    state, _ = jax.jit(TINY.env.reset_worlds)(keys_of(0, 5))
    for seed in range(3):
        action = jax.random.uniform(jax.random.key(seed), (2, 2, 5))
        state, _ = step(state, action, keys_of(seed, 5))
    assert len(traces) == 1
