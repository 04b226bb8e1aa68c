"""The shared buffer against a Python deque."""

import collections
import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from oracles.toy import AGENTS, Toy, ToyTeam, live
from skillcrew.replay import ReplayBuffer, Transitions, transitions_of
from skillcrew.rollout import Lineup, Start, rollout

CAPACITY, ITEMS, OBSERVATION, ACTION, SKILLS = 11, 7, 3, 2, 4
BUFFER = ReplayBuffer(CAPACITY, OBSERVATION, ACTION, SKILLS)


def numbered(first: int, count: int = ITEMS) -> Transitions:
    """Transitions whose every entry tells which one it is of, and which field."""
    number = jnp.arange(first, first + count, dtype=jnp.float32)

    def field(offset: float, width: int):
        return 100 * number[:, None] + offset + jnp.arange(width, dtype=jnp.float32)[None]

    return Transitions(
        observation=field(10, OBSERVATION),
        action=field(20, ACTION),
        next_observation=field(30, OBSERVATION),
        local_rewards=field(40, SKILLS),
        team_reward=100 * number + 50,
        terminated=100 * number + 60,
    )


add = jax.jit(BUFFER.add)


@functools.cache
def sampler(batch: int):
    return jax.jit(lambda state, key: BUFFER.sample(state, key, batch))


def numbers_held(state) -> list[int]:
    """The numbers of the transitions held, oldest first."""
    size, end = int(BUFFER.size(state)), int(state.current_index)
    rows = np.roll(np.asarray(state.experience[0]), -end, axis=0)[CAPACITY - size :]
    # Observations come first in a row.
    return ((rows[:, 0] - 10) / 100).astype(int).tolist()


@settings(max_examples=80)
@given(st.lists(st.lists(st.booleans(), min_size=ITEMS, max_size=ITEMS), min_size=1, max_size=6))
def test_holds_what_a_deque_holds(adds: list[list[bool]]) -> None:
    state, expected = BUFFER.init(), collections.deque(maxlen=CAPACITY)
    for index, lived in enumerate(adds):
        state = add(state, numbered(index * ITEMS), jnp.array(lived))
        expected.extend(index * ITEMS + item for item in range(ITEMS) if lived[item])
        assert int(BUFFER.size(state)) == len(expected)
        assert numbers_held(state) == list(expected)


@pytest.mark.parametrize("adds", [1, 2, 5])
def test_samples_stored_transitions_uniformly_and_whole(adds: int) -> None:
    state, everything = BUFFER.init(), []
    lived = np.array([True, False, True, True, False, True, True])
    for index in range(adds):
        state = add(state, numbered(index * ITEMS), jnp.asarray(lived))
        everything += [index * ITEMS + item for item in range(ITEMS) if lived[item]]
    held = everything[-CAPACITY:]
    drawn = sampler(20_000)(state, jax.random.key(adds))
    number = ((np.asarray(drawn.team_reward) - 50) / 100).astype(int)
    expected = numbered(0, ITEMS * adds)
    for field in ("observation", "action", "next_observation", "local_rewards", "terminated"):
        values, stored = (np.asarray(getattr(one, field)) for one in (drawn, expected))
        np.testing.assert_array_equal(values, stored[number])
    counts = np.bincount(number, minlength=ITEMS * adds)
    assert set(np.flatnonzero(counts)) == set(held)
    assert stats.chisquare(counts[held]).pvalue > 1e-3


def test_a_donated_buffer_is_changed_in_place_by_a_program_traced_once() -> None:
    traced = []

    @functools.partial(jax.jit, donate_argnums=0)
    def add_donated(state, transitions, lived):
        traced.append(1)
        return BUFFER.add(state, transitions, lived)

    state = jax.tree.map(jnp.copy, BUFFER.init())
    place = state.experience.unsafe_buffer_pointer()
    for index in range(3):
        state = add_donated(state, numbered(index * ITEMS), jnp.ones(ITEMS, bool))
        assert state.experience.unsafe_buffer_pointer() == place
    assert len(traced) == 1
    assert numbers_held(state) == list(range(3 * ITEMS - CAPACITY, 3 * ITEMS))


def test_more_items_than_the_buffer_holds_are_refused() -> None:
    with pytest.raises(ValueError, match="12 transitions do not fit a buffer of 11"):
        BUFFER.add(BUFFER.init(), numbered(0, 12), jnp.ones(12, bool))


@pytest.fixture(scope="module")
def from_rollout():
    """Transitions of a rollout, and the Python loop's episodes."""
    env, worlds = Toy(), 6

    @jax.jit
    def run(key):
        start, team = Start.draw(env, key, worlds), ToyTeam.create(key)
        _, lived = rollout(env, Lineup.of_team(team, start), key)
        return start, team, transitions_of(lived)

    start, team, (transitions, lived) = run(jax.random.key(5))
    episodes = [
        live(np.asarray(team.weights), np.asarray(start.state["offset"][:, w]), int(start.state["limit"][w]))
        for w in range(worlds)
    ]
    return jax.tree.map(lambda leaf: np.asarray(leaf)[np.asarray(lived)], transitions), episodes


def in_order(episodes) -> list:
    """What was lived, by time, then world, then agent."""
    longest = max(len(steps) for steps in episodes)
    lived = [steps[time] for time in range(longest) for steps in episodes if time < len(steps)]
    return [(step, agent) for step in lived for agent in range(AGENTS)]


@pytest.mark.parametrize("field", ["observation", "action", "next_observation", "local_rewards"])
def test_every_agents_every_lived_step_is_a_transition(from_rollout, field: str) -> None:
    transitions, episodes = from_rollout
    expected = [getattr(step, field)[agent] for step, agent in in_order(episodes)]
    np.testing.assert_allclose(getattr(transitions, field), expected, rtol=1e-4, atol=1e-4)


def test_the_team_reward_is_every_agents(from_rollout) -> None:
    transitions, episodes = from_rollout
    expected = [step.team_reward for step, _ in in_order(episodes)]
    np.testing.assert_allclose(transitions.team_reward, expected, rtol=1e-4, atol=1e-4)


def test_last_steps_are_stored_and_only_done_tasks_are_terminated(from_rollout) -> None:
    transitions, episodes = from_rollout
    expected = [float(step.terminated) for step, _ in in_order(episodes)]
    assert transitions.terminated.tolist() == expected
    assert sum(expected) == AGENTS * sum(steps[-1].terminated for steps in episodes)
    # At least one episode was cut off by the time limit, and bootstraps.
    assert not all(steps[-1].terminated for steps in episodes)
