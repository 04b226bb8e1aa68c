"""The warehouse as an `Environment`, and what it offers beyond `reset` and `step`."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import skillcrew as sc
from oracles import warehouse
from oracles.carrying import Decisions
from oracles.checking import complaints
from oracles.comparing import BORDER, one_world, random_actions
from oracles.refusals import refusal, unhooked
from oracles.warehouse_cases import (
    CASES,
    WORLDS,
    compiled_step,
    environment,
    random_states,
)
from skillcrew.envs.offers import OffersCentralState, OffersScene, OffersSkillTexts, offers
from skillcrew.envs.warehouse import config as module

CASE = "one order"


def worlds_of(case: str, seed: int):
    env, rng = environment(case), np.random.default_rng(seed)
    return env, random_states(env.config, rng), random_actions(env.config, rng, WORLDS)


def test_nothing_is_wrong_with_it() -> None:
    assert complaints(sc.make("warehouse-o1-c2", n_shelves=1, n_stations=2)) == []


def test_many_worlds_step_like_each_of_them() -> None:
    env, states, actions = worlds_of(CASE, 3)
    keys = jax.random.split(jax.random.key(0), WORLDS)
    together = compiled_step(CASE)(states, actions, keys)
    one_by_one = jax.jit(jax.vmap(env.step, in_axes=(-1, -1, 0), out_axes=-1))(states, actions, keys)
    for ours, theirs in zip(jax.tree.leaves(together), jax.tree.leaves(one_by_one), strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=2e-5, atol=2e-5)


@pytest.fixture(scope="module")
def draws():
    """The states and observations of two thousand resets, world axis last."""
    return jax.jit(environment(CASE).reset_worlds)(jax.random.split(jax.random.key(1), 2000))


def test_places_are_drawn_as_the_page_says(draws) -> None:
    config, state = environment(CASE).config, jax.tree.map(np.asarray, draws[0])
    assert 0.23 * config.width < np.abs(state.gap).max() <= 0.25 * config.width
    for places, x in ((state.shelf, 1 - config.length / 2), (state.station, config.length / 2 - 1)):
        np.testing.assert_allclose(places[:, 0], x)
        band = config.width / len(places)
        middles = -config.width / 2 + band * (np.arange(len(places)) + 0.5)
        aside = np.abs(places[:, 1] - middles[:, None])
        assert 0.29 * band < aside.max() <= 0.3 * band + 1e-5
    x, y = np.moveaxis(state.position, 1, 0)
    assert config.corridor_length / 2 <= np.abs(x).min() and np.abs(x).max() <= config.length / 2
    np.testing.assert_allclose((x < 0).mean(1), 0.5, atol=0.04)
    assert 0.49 * config.width < np.abs(y).max() <= config.width / 2


def test_orders_are_drawn_as_the_page_says(draws) -> None:
    config, state = environment(CASE).config, jax.tree.map(np.asarray, draws[0])
    for drawn, count in (
        (state.from_shelf, config.n_shelves),
        (state.to_station, config.n_stations),
        (state.comes_at, config.latest_order + 1),
    ):
        values, counts = np.unique(drawn, return_counts=True)
        assert values.tolist() == list(range(count))
        np.testing.assert_allclose(counts / drawn.size, 1 / count, atol=0.04)
    for w in range(50):
        np.testing.assert_array_equal(state.load[0, :, w], state.shelf[state.from_shelf[0, w], :, w])
    assert not state.delivered.any()


def test_what_is_seen_first_and_who_lifts_at_once() -> None:
    env = environment("alone")
    states, observation = jax.jit(env.reset_worlds)(jax.random.split(jax.random.key(2), 200))
    lifted_at_once = 0
    for w in range(200):
        state, by = one_world(warehouse.State, states, w), Decisions()
        started = warehouse.lifted(env.config, by, dataclasses.replace(state, held=state.held & False))
        seen = [warehouse.observation_of(env.config, by, state, agent) for agent in range(env.n_agents)]
        if by.gap > BORDER:
            np.testing.assert_array_equal(state.held, started.held)
            np.testing.assert_allclose(observation[..., w], np.stack(seen), rtol=5e-5, atol=2e-5)
            lifted_at_once += state.held.any()
    assert lifted_at_once > 2


@settings(max_examples=5)
@given(seed=st.integers(0, 2**32 - 1))
def test_what_always_holds(seed: int) -> None:
    env, states, actions = worlds_of("in threes", seed)
    config, keys = env.config, jax.random.split(jax.random.key(seed), WORLDS)
    half, room = config.corridor_length / 2, config.corridor_width / 2
    for _ in range(3):
        after, step = compiled_step("in threes")(states, actions, keys)
        held, delivered, position = (
            np.asarray(leaf) for leaf in (after.held, after.delivered, after.position)
        )
        assert held.sum(0).max() <= 1, "nobody holds two"
        assert np.isin(held.sum(1), [0, *range(config.coupling, config.n_agents + 1)]).all()
        assert not (held.any(1) & delivered).any()
        inside = np.abs(position[:, 0]) < half
        off = np.abs(position[:, 1] - np.asarray(after.gap)[None])
        assert (off[inside] <= room + 1e-4).all(), "nobody is in the wall"
        crossed = np.asarray(states.position)[:, 0] * position[:, 0] < 0
        assert (crossed <= (inside | (np.abs(np.asarray(states.position)[:, 0]) < half))).all()
        assert np.asarray(step.local_rewards).min() >= 0
        assert np.asarray(step.local_rewards).max() <= 1
        np.testing.assert_array_equal(np.asarray(step.terminated), delivered.all(0))
        states = after


def test_one_enters_at_a_time_but_for_fellows() -> None:
    """Three at the mouth: each alone, then the last two as bearers of one load."""
    env = environment("in threes")
    _, states, _ = worlds_of("in threes", 0)
    first = jax.tree.map(lambda leaf: leaf[..., 0], states)
    waiting = jnp.array([[-1.0, 0.5], [-1.0, 0.0], [-1.0, -0.5], [4.0, 0.0], [4.0, 1.0]])
    nobody = jnp.zeros((3, 5), bool)
    bears = nobody.at[1].set(jnp.array([False, True, True, True, False]))
    state = dataclasses.replace(
        first, position=waiting, gap=jnp.zeros(()), held=nobody, delivered=jnp.zeros(3, bool)
    )
    go, step = jnp.zeros((5, 2)).at[:3, 0].set(1.0), jax.jit(env.step)

    def entered(state) -> list[bool]:
        after, _ = step(state, go, jax.random.key(0))
        return (jnp.abs(after.position[:3, 0]) < 0.75).tolist()

    assert entered(state) == [True, False, False]
    assert entered(dataclasses.replace(state, held=bears)) == [True, False, False], "the first comes first"
    behind = state.position.at[0, 0].set(-3.0)
    assert entered(dataclasses.replace(state, held=bears, position=behind)) == [False, True, True]
    occupied = behind.at[3].set(jnp.array([0.7, 0.0]))
    assert entered(dataclasses.replace(state, position=occupied)) == [False, False, False]
    assert entered(dataclasses.replace(state, held=bears, position=occupied)) == [False, True, True]


def test_what_it_offers() -> None:
    env, states, _ = worlds_of(CASE, 5)
    for offer in (OffersCentralState, OffersScene, OffersSkillTexts):
        assert offers(env, offer)
    assert tuple(env.skill_texts) == env.skills
    one = jax.tree.map(lambda leaf: leaf[..., 3], states)
    seen = np.asarray(jax.jit(env.central_state)(one))
    agents, orders, shelves, stations = 2, 1, 3, 4
    places = 2 * (agents + shelves + stations + orders) + 1
    assert seen.shape == (places + orders * (shelves + stations + 1 + agents + 1) + 1,)
    np.testing.assert_allclose(seen[:4], np.ravel(one.position))
    assert seen[places : places + shelves].tolist() == np.eye(shelves)[int(one.from_shelf[0])].tolist()
    np.testing.assert_allclose(seen[-1], one.time / env.episode_length)


def test_the_scene_shows_loads_bearers_and_the_wall() -> None:
    env, states, _ = worlds_of("in threes", 5)
    config, draw = env.config, jax.jit(env.scene)
    for w in range(20):
        one = jax.tree.map(lambda leaf, w=w: leaf[..., w], states)
        scene = draw(one)
        agents, loads = scene.points
        np.testing.assert_array_equal(agents.position, one.position)
        come = np.asarray(one.comes_at) <= int(one.time)
        for order, state in enumerate(np.asarray(loads.state)):
            held, delivered = bool(one.held[order].any()), bool(one.delivered[order])
            said = "delivered" if delivered else "carried" if held else "waiting" if come[order] else None
            assert (loads.states[state] if state >= 0 else None) == said
        wall, holds = scene.lines
        assert (np.asarray(holds.state) == 0).sum() == np.asarray(one.held).sum()
        ends = np.concatenate([np.asarray(wall.start), np.asarray(wall.end)])
        np.testing.assert_allclose(np.abs(ends[:, 0]), config.corridor_length / 2)
        mouths = ends[np.abs(ends[:, 1]) < config.width / 2 - 1e-3, 1] - float(one.gap)
        np.testing.assert_allclose(np.abs(mouths), config.corridor_width / 2, rtol=1e-4)
        (labels,) = scene.labels
        assert labels.texts == ("A", "B", "1")


@pytest.mark.parametrize(
    ("fields", "parts"),
    [
        (dict(n_orders=0), ["n_orders = 0", "at least 1"]),
        (dict(coupling=3), ["coupling = 3", "n_agents = 2"]),
        (dict(n_shelves=27), ["n_shelves = 27", "26"]),
        (dict(latest_order=60), ["latest_order = 60", "episode_length = 60"]),
        (dict(reach=0.0), ["reach = 0.0", "positive"]),
        (dict(carry_speed=2.0), ["carry_speed = 2.0", "max_speed = 1.0"]),
        (dict(corridor_length=1.0), ["corridor_length = 1.0", "max_speed = 1.0"]),
        (dict(corridor_width=6.0), ["corridor_width = 6.0", "width = 10.0"]),
        (dict(length=5.0), ["length = 5.0", "at least 7"]),
    ],
)
def test_what_cannot_be_meant_is_refused(fields, parts) -> None:
    message = refusal(unhooked(module).WarehouseConfig, **fields)
    assert all(part in message for part in parts)


def test_cases_are_of_unequal_sizes() -> None:
    for fields in CASES.values():
        assert len({fields[name] for name in ("n_agents", "n_orders", "n_shelves", "n_stations")}) == 4
