"""Search and rescue as an `Environment`, and what it offers beyond `reset` and `step`."""

import dataclasses
import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import skillcrew as sc
from oracles import rescue
from oracles.carrying import Decisions
from oracles.checking import complaints
from oracles.comparing import BORDER, one_world, random_actions
from oracles.refusals import refusal, unhooked
from oracles.rescue_cases import (
    CASES,
    WORLDS,
    compiled_step,
    environment,
    random_states,
)
from skillcrew.envs.offers import (
    OffersCentralState,
    OffersCounterfactuals,
    OffersScene,
    OffersSkillTexts,
    offers,
)
from skillcrew.envs.rescue import config as module
from skillcrew.envs.rescue.config import BASE_SHARE

CASE = "two victims"


def worlds_of(case: str, seed: int):
    env, rng = environment(case), np.random.default_rng(seed)
    return env, random_states(env.config, rng), random_actions(env.config, rng, WORLDS)


def test_nothing_is_wrong_with_it() -> None:
    assert complaints(sc.make("rescue-v1-c2", n_agents=2, cells=2, sensor_radius=6.0)) == []


def test_many_worlds_step_like_each_of_them() -> None:
    env, states, actions = worlds_of(CASE, 3)
    keys = jax.random.split(jax.random.key(0), WORLDS)
    together = compiled_step(CASE)(states, actions, keys)
    one_by_one = jax.jit(jax.vmap(env.step, in_axes=(-1, -1, 0), out_axes=-1))(states, actions, keys)
    for ours, theirs in zip(jax.tree.leaves(together), jax.tree.leaves(one_by_one), strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=2e-5, atol=2e-5)


def test_worlds_are_drawn_as_the_page_says() -> None:
    env = environment(CASE)
    config = env.config
    state, observation = jax.jit(env.reset_worlds)(jax.random.split(jax.random.key(1), 2000))
    margin = (1 - BASE_SHARE) / 2 * config.world_size
    base = np.asarray(state.base)
    assert margin <= base.min() and base.max() <= config.world_size - margin
    assert np.ptp(base, axis=1).min() > 0.95 * BASE_SHARE * config.world_size
    start = np.abs(np.asarray(state.position) - base[None])
    assert 0.95 * config.base_radius < start.max() <= config.base_radius + 1e-5
    away = np.hypot(*np.moveaxis(np.asarray(state.victim) - base[None], 1, 0))
    assert away.min() >= config.victim_distance - 1e-4
    # Those that would lie nearer are moved to that distance.
    assert 0.1 < np.mean(away < config.victim_distance + 1e-3) < 0.6
    assert np.asarray(state.victim).min() >= 0 and np.asarray(state.victim).max() <= config.world_size
    assert not np.asarray(state.held).any() and not np.asarray(state.saved).any()
    started = [one_world(rescue.State, state, w) for w in range(40)]
    for w, one in enumerate(started):
        by = Decisions()
        blank = dataclasses.replace(one, searched=np.zeros_like(one.searched))
        marked = rescue.search(config, by, blank)
        views = rescue.Views(config, by, marked)
        if by.gap > BORDER:
            np.testing.assert_array_equal(one.searched, marked.searched)
            seen = np.stack([views.observation(agent) for agent in range(config.n_agents)])
            np.testing.assert_allclose(observation[..., w], seen, rtol=5e-5, atol=2e-5)


@settings(max_examples=5)
@given(seed=st.integers(0, 2**32 - 1))
def test_what_always_holds(seed: int) -> None:
    env, states, actions = worlds_of(CASE, seed)
    config, keys = env.config, jax.random.split(jax.random.key(seed), WORLDS)
    for _ in range(3):
        after, step = compiled_step(CASE)(states, actions, keys)
        held, saved = np.asarray(after.held), np.asarray(after.saved)
        assert held.sum(0).max() <= 1, "nobody holds two"
        assert np.isin(held.sum(1), [0, *range(config.coupling, config.n_agents + 1)]).all()
        assert not (held.any(1) & saved).any()
        assert (saved >= np.asarray(states.saved)).all()
        assert np.abs(np.asarray(step.local_rewards)).max() <= 1 + 1e-5
        np.testing.assert_array_equal(np.asarray(step.terminated), saved.all(0))
        lying = ~np.asarray(states.held).any(1)
        np.testing.assert_array_equal(
            np.moveaxis(np.asarray(after.victim), 1, -1)[lying],
            np.moveaxis(np.asarray(states.victim), 1, -1)[lying],
        )
        states = after


def without_or_with_more(case: str, state: rescue.State, action: np.ndarray, agent: int, copies: int):
    """The team's reward in a world in which an agent is there so many times, each holding what it holds."""
    rules, by = environment(case).config, Decisions()
    keep = [one for one in range(len(state.position)) for _ in range(copies if one == agent else 1)]
    world = dataclasses.replace(
        state, position=state.position[keep], held=state.held[:, keep], next_cell=state.next_cell[keep]
    )
    after = rescue.moved(rules, by, world, action[keep])
    return rescue.team_reward(world, after), by.gap


def of_each(env, state, action, copies: int):
    """For each agent the team's reward of one step if that agent were there so many times."""
    times = jnp.where(jnp.eye(env.n_agents, dtype=bool), copies, 1)
    return jax.vmap(lambda one: env.counterfactual_step(state, state, action, jax.random.key(0), one)[1])(
        times
    )


@pytest.mark.parametrize("case", ["two victims", "three to lift"])
@pytest.mark.parametrize("copies", [0, 1, 3])
def test_counterfactuals_are_those_of_worlds_with_other_teams(case: str, copies: int) -> None:
    env, states, actions = worlds_of(case, 10 + copies)
    rewards = jax.jit(
        jax.vmap(lambda state, action: of_each(env, state, action, copies), in_axes=-1, out_axes=-1)
    )(states, actions)
    compared = paid = changed = 0
    for w in range(WORLDS):
        state, action = one_world(rescue.State, states, w), np.asarray(actions, np.float64)[..., w]
        _, outcome, _ = rescue.step(env.config, state, action)
        for agent in range(env.n_agents):
            expected, gap = without_or_with_more(case, state, action, agent, copies)
            if gap > BORDER:
                assert rewards[agent, w] == expected
                compared += 1
                paid += expected
                changed += expected != outcome.team_reward
    assert compared > 0.8 * env.n_agents * WORLDS
    assert paid > 0
    # Without somebody much is not carried; more hands rarely decide.
    assert changed > 0 if copies == 0 else changed == 0 or copies == 3


@pytest.mark.parametrize("copies", [0, 2])
def test_counterfactual_worlds_go_on_from_what_they_became(copies: int) -> None:
    env, states, actions = worlds_of("two victims", 30 + copies)
    steps = [actions, actions[:, ::-1], actions]

    @jax.jit
    @functools.partial(jax.vmap, in_axes=-1, out_axes=-1)
    def lived(state, *steps):
        times = jnp.ones(env.n_agents, jnp.int32).at[1].set(copies)
        other = env.counterfactual(state)
        for action in steps:
            other, _ = env.counterfactual_step(state, other, action, jax.random.key(0), times)
        return other

    after, compared, carried = lived(states, *steps), 0, 0
    keep = [one for one in range(env.n_agents) for _ in range(copies if one == 1 else 1)]
    for w in range(WORLDS):
        state, by = one_world(rescue.State, states, w), Decisions()
        world = dataclasses.replace(
            state, position=state.position[keep], held=state.held[:, keep], next_cell=state.next_cell[keep]
        )
        for action in steps:
            world = rescue.moved(env.config, by, world, np.asarray(action, np.float64)[keep, :, w])
        if by.gap <= BORDER:
            continue
        compared += 1
        carried += not np.allclose(world.victim, state.victim)
        np.testing.assert_allclose(np.asarray(after.victim)[..., w], world.victim, atol=2e-5)
        np.testing.assert_allclose(np.asarray(after.position)[keep, :, w], world.position, atol=2e-5)
        np.testing.assert_array_equal(np.asarray(after.saved)[:, w], world.saved)
        np.testing.assert_array_equal(np.asarray(after.held)[:, keep, w], world.held)
    assert compared > 0.6 * WORLDS and carried > 10


def test_copies_pull_as_so_many_hands() -> None:
    """One bearer goes to the base and the other, slowly, away from it; the victim is just outside."""
    env, states, _ = worlds_of(CASE, 1)
    first = jax.tree.map(lambda leaf: leaf[..., 0], states)
    state = dataclasses.replace(
        first,
        base=jnp.array([7.0, 7.0]),
        victim=jnp.array([[9.3, 7.0], [7.0, 7.0]]),
        saved=jnp.array([False, True]),
        position=jnp.array([[9.3, 7.0], [9.3, 7.2], [1.0, 1.0]]),
        held=jnp.array([[True, True, False], [False, False, False]]),
    )
    action = jnp.array([[-1.0, 0.0], [0.5, 0.0], [0.0, 0.0]])
    rewards = jax.jit(lambda copies: of_each(env, state, action, copies))
    said = {copies: rewards(copies).tolist() for copies in (0, 1, 3)}
    # On average -0.175 m; with three of the first -0.4375 m, which saves; too few hands without either.
    assert said == {0: [0.0, 0.0, 0.0], 1: [0.0, 0.0, 0.0], 3: [1.0, 0.0, 0.0]}


def test_what_it_offers() -> None:
    env, states, _ = worlds_of(CASE, 5)
    for offer in (OffersCentralState, OffersCounterfactuals, OffersScene, OffersSkillTexts):
        assert offers(env, offer)
    assert tuple(env.skill_texts) == env.skills
    one = jax.tree.map(lambda leaf: leaf[..., 0], states)
    seen = np.asarray(jax.jit(env.central_state)(one))
    agents, victims, cells = 3, 2, 25
    assert seen.shape == (2 + 2 * agents + 2 * victims + victims * agents + victims + cells + 1,)
    np.testing.assert_allclose(seen[:2], one.base)
    np.testing.assert_allclose(
        seen[2:8], np.ravel(np.asarray(one.position) - np.asarray(one.base)), rtol=1e-5
    )
    np.testing.assert_allclose(seen[-1], one.time / env.episode_length)


def test_the_scene_shows_who_is_where_and_who_holds_whom() -> None:
    env, states, _ = worlds_of(CASE, 5)
    draw = jax.jit(env.scene)
    for w in range(20):
        one = jax.tree.map(lambda leaf, w=w: leaf[..., w], states)
        scene = draw(one)
        agents, victims = scene.points
        np.testing.assert_array_equal(agents.position, one.position)
        said = [victims.states[state] for state in np.asarray(victims.state)]
        held, saved = np.asarray(one.held).any(1), np.asarray(one.saved)
        assert said == [
            "saved" if s else "carried" if h else "lying" for h, s in zip(held, saved, strict=True)
        ]
        (holds,) = scene.lines
        shown = np.asarray(holds.state) == 0
        assert shown.sum() == np.asarray(one.held).sum()
        pairs = np.argwhere(np.asarray(one.held))
        np.testing.assert_array_equal(np.asarray(holds.start)[shown], np.asarray(one.position)[pairs[:, 1]])
        np.testing.assert_array_equal(np.asarray(holds.end)[shown], np.asarray(one.victim)[pairs[:, 0]])


@pytest.mark.parametrize(
    ("fields", "parts"),
    [
        (dict(n_agents=1, coupling=1), ["n_agents = 1", "at least 2"]),
        (dict(n_victims=0), ["n_victims = 0", "at least 1"]),
        (dict(coupling=4), ["coupling = 4", "n_agents = 3"]),
        (dict(reach=-1.0), ["reach = -1.0", "positive"]),
        (dict(carry_speed=2.0), ["carry_speed = 2.0", "max_speed = 1.0"]),
        (dict(victim_distance=1.0), ["victim_distance = 1.0", "base_radius = 2.0"]),
        (dict(victim_distance=7.0), ["victim_distance = 7.0", "5.6"]),
        (dict(cells=3), ["cells = 3", "sensor_radius = 3.0", "more cells"]),
    ],
)
def test_what_cannot_be_meant_is_refused(fields, parts) -> None:
    message = refusal(unhooked(module).RescueConfig, **fields)
    assert all(part in message for part in parts)


def test_cases_are_of_unequal_sizes() -> None:
    for fields in CASES.values():
        assert fields["n_agents"] != fields["n_victims"]
