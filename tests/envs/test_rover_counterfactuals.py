"""Episodes with a rover gone, or there several times, beside the oracle's worlds with other teams."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from oracles import rover
from oracles.rover_cases import (
    BORDER,
    CASES,
    best_visits,
    environment,
    gap_to_borders,
    one_world,
    oracle_world,
    random_actions,
    random_states,
)
from skillcrew.envs.offers import OffersCounterfactuals, require
from skillcrew.envs.rover.motion import moved
from skillcrew.envs.rover.world import RoverDomain

STEPS = 4
WORLDS = 40
"""In each, every agent is gone, alone, twice and four times."""


def with_copies(
    world: rover.World, state: rover.State, agent: int, copies: int
) -> tuple[rover.World, rover.State, list[int]]:
    """The rules and a state in which a rover is there so many times, and whom each is a copy of."""
    keep = [one for one in range(world.n_agents) for _ in range(copies if one == agent else 1)]
    kinds = tuple(
        dataclasses.replace(kind, rovers=sum(world.kind_of(one) == place for one in keep))
        for place, kind in enumerate(world.kinds)
    )
    broken = None if state.breaks_at is None else state.breaks_at[keep]
    state = dataclasses.replace(
        state, position=state.position[keep], heading=state.heading[keep], breaks_at=broken
    )
    return dataclasses.replace(world, n_agents=len(keep), kinds=kinds), state, keep


def lived(world: rover.World, state: rover.State, actions: np.ndarray) -> tuple[list[float], rover.State]:
    """The team's reward of each step, and the state in the end."""
    rewards = []
    for action in actions:
        _, after = rover.advanced(world, state, action)
        rewards.append(rover.shown(world, after) - rover.shown(world, state))
        state = after
    return rewards, state


def far_from_borders(world: rover.World, state: rover.State, actions: np.ndarray) -> bool:
    for action in actions:
        _, state = rover.advanced(world, state, action)
        if gap_to_borders(world, state) <= BORDER:
            return False
    return True


def counterfactual_episodes(case: str):
    """Rewards [steps, agents, worlds] and what each team has to show in the end, its agent there so often."""
    env = environment(case)
    inner = require(env, OffersCounterfactuals, "the test")
    of_worlds = jax.vmap(inner.counterfactual_step, in_axes=(-1, -1, -1, None, None), out_axes=-1)

    def step(carry, action, times):
        state, other = carry
        given = env.transform_action(action) if env is not inner else action
        other, reward = of_worlds(state, other, given, jax.random.key(0), times)
        there, _ = moved(inner.config, state, action)
        return (dataclasses.replace(there, time=state.time + 1), other), reward

    @jax.jit
    def episodes(states, actions, copies):
        times = jnp.where(jnp.eye(env.n_agents, dtype=bool), copies, 1)

        def of_agent(times):
            begun = states, jax.vmap(inner.counterfactual, in_axes=-1, out_axes=-1)(states)
            (_, other), rewards = jax.lax.scan(
                lambda carry, action: step(carry, action, times), begun, actions
            )
            return rewards, other

        return jax.vmap(of_agent, out_axes=(1, 0))(times)

    return episodes


@pytest.mark.parametrize(
    "case",
    [
        *("thesis t3 c2", "graph 120", "six in threes", "groups moving", "groups breaking", "drawn", "crew"),
        *("value", "closest", "closest of groups", "closest alone", "closest of a crew"),
    ],
)
def test_episodes_are_those_of_worlds_with_other_teams(case: str) -> None:
    world, rng = oracle_world(**CASES[case]), np.random.default_rng(11)
    episodes = counterfactual_episodes(case)
    changed = dict.fromkeys((0, 1, 2, 4), 0)
    for copies in changed:
        states = random_states(world, rng, WORLDS)
        actions = jnp.stack([random_actions(world, rng, WORLDS) for _ in range(STEPS)])
        rewards, shown = jax.tree.map(np.asarray, episodes(states, actions, copies))
        as_lived = np.asarray(episodes(states, actions, 1)[0])
        acted = np.asarray(actions, np.float64)
        states = jax.device_get(states)
        paid, observed = np.zeros(rewards.shape), np.zeros_like(shown.observed)
        best = np.zeros(observed.shape)
        kept = np.zeros(WORLDS, bool)
        for w in range(WORLDS):
            before = one_world(world, states, w)
            kept[w] = far_from_borders(world, before, acted[..., w])
            for agent in range(world.n_agents) if kept[w] else ():
                other, start, keep = with_copies(world, before, agent, copies)
                paid[:, agent, w], after = lived(other, start, acted[..., w][:, keep])
                observed[agent, :, w] = after.observed
                best[agent, :, w] = 0.0 if after.best is None else after.best
        assert kept.mean() > 0.7
        np.testing.assert_allclose(rewards[..., kept], paid[..., kept], atol=1e-6)
        np.testing.assert_array_equal(shown.observed[..., kept], observed[..., kept])
        if shown.closest is not None:
            closest = np.stack([best_visits(world, of_agent) for of_agent in shown.closest])
            np.testing.assert_allclose(closest[..., kept], best[..., kept], rtol=2e-5, atol=1e-5)
        same = np.isclose(paid[..., kept], as_lived[..., kept], atol=1e-6).all(0)
        changed[copies] += (~same).sum()
    assert changed[1] == 0
    assert changed[0] > 0, changed
    # Where one rover is enough, more of it change nothing.
    alone = world.coupling == 1 and not world.kinds
    assert changed[4] == 0 if alone else changed[4] > 0, changed


@pytest.mark.parametrize("case", ["groups breaking", "closest", "value of groups"])
def test_one_of_each_is_the_step_itself(case: str) -> None:
    world, env = oracle_world(**CASES[case]), environment(case)
    assert isinstance(env, RoverDomain)
    rng = np.random.default_rng(3)
    states, actions = random_states(world, rng, WORLDS), random_actions(world, rng, WORLDS)
    keys = jax.random.split(jax.random.key(0), WORLDS)
    after, step = jax.jit(env.step_worlds)(states, actions, keys)
    ones = jnp.ones(env.n_agents, jnp.int32)
    counted = jax.jit(jax.vmap(env.counterfactual_step, in_axes=(-1, -1, -1, 0, None), out_axes=-1))
    other, reward = counted(states, env.counterfactual(states), actions, keys, ones)
    np.testing.assert_allclose(reward, step.team_reward, atol=1e-6)
    shown = env.counterfactual(after)
    np.testing.assert_array_equal(other.observed, shown.observed)
    assert (other.closest is None) == (shown.closest is None)
    if other.closest is not None:
        np.testing.assert_allclose(other.closest, shown.closest, rtol=1e-6)
