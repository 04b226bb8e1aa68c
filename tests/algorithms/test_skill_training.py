"""K skills that learn from one buffer, each on its own reward."""

import functools
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import optax
import pytest

from skillcrew.algorithms.skill_training import run_unless, train_skills
from skillcrew.learners.td3 import TD3, TD3Config, TD3State
from skillcrew.policies.network import NetworkConfig
from skillcrew.replay import ReplayBuffer, Transitions

SKILLS, OBSERVATION, ACTION, ITEMS, UPDATES = 3, 4, 2, 50, 300
REWARDS = np.array([-1.0, 0.5, 2.0])
LEARNER = TD3(
    TD3Config(batch_size=16, critic_learning_rate=1e-2, policy_delay=2, network=NetworkConfig((8,))),
    OBSERVATION,
    ACTION,
)


def train(
    key,
    learners: TD3State,
    stopped,
    terminated=1.0,
    task_ends_skills: bool = True,
    *,
    updates: int,
    learner: TD3 = LEARNER,
) -> Any:
    """Every transition ends the task, if not told otherwise, and pays each skill its constant."""
    buffer = ReplayBuffer(ITEMS, OBSERVATION, ACTION, SKILLS)
    draw = jax.random.normal(jax.random.key(1), (ITEMS, OBSERVATION))
    transitions = Transitions(
        observation=draw,
        action=jnp.tanh(draw[:, :ACTION]),
        next_observation=draw,
        local_rewards=jnp.tile(jnp.asarray(REWARDS, jnp.float32), (ITEMS, 1)),
        team_reward=jnp.full(ITEMS, 77.0),
        terminated=jnp.full(ITEMS, terminated),
    )
    experience = buffer.add(buffer.init(), transitions, jnp.ones(ITEMS, bool))
    return train_skills(key, learner, learners, stopped, buffer, experience, updates, task_ends_skills)


program = jax.jit(functools.partial(train, updates=UPDATES))


@pytest.fixture(scope="module")
def learners() -> TD3State:
    return jax.jit(jax.vmap(LEARNER.init))(jax.random.split(jax.random.key(0), SKILLS))


@pytest.fixture(scope="module")
def trained(learners):
    return program(jax.random.key(2), learners, jnp.zeros(SKILLS, bool))


def test_each_skill_learns_the_value_of_its_own_reward(trained) -> None:
    observation, action = jax.random.normal(jax.random.key(1), (ITEMS, OBSERVATION)), jnp.zeros(ACTION)
    for skill in range(SKILLS):
        critics = jax.tree.map(lambda leaf, skill=skill: leaf[skill], trained[0].critics)
        first = jax.tree.map(lambda leaf: leaf[0], critics)
        values = jax.vmap(first, in_axes=(0, None))(observation, action)
        assert float(values.mean()) == pytest.approx(REWARDS[skill], abs=0.2)


def test_updates_are_of_critics_and_the_actor_is_delayed(trained) -> None:
    def count(state: optax.OptState) -> list[int]:
        return optax.tree.get(state, "count").tolist()

    assert count(trained[0].critic_optimiser) == [UPDATES] * SKILLS
    assert count(trained[0].actor_optimiser) == [UPDATES // 2] * SKILLS


def changed(before: TD3State, after: TD3State) -> list[bool]:
    """For each skill, whether any number of its learner changed."""
    pairs = list(zip(jax.tree.leaves(before), jax.tree.leaves(after), strict=True))
    return [
        any(not np.array_equal(one[skill], other[skill]) for one, other in pairs) for skill in range(SKILLS)
    ]


def test_stopped_skills_stay_as_they_are_bit_by_bit(learners, trained) -> None:
    after, losses = program(jax.random.key(2), learners, jnp.array([False, True, False]))
    assert changed(learners, after) == [True, False, True]
    # The others learn as if nobody had stopped.
    assert changed(trained[0], after) == [False, True, False]
    for name in ("critic_loss", "actor_loss"):
        assert np.isnan(losses[name]).tolist() == [False, True, False]


def test_a_skills_value_goes_on_where_the_task_ends_unless_told_otherwise(learners, trained) -> None:
    here = jnp.zeros(SKILLS, bool)
    goes_on = jax.jit(functools.partial(train, updates=UPDATES, task_ends_skills=False))
    after, _ = goes_on(jax.random.key(2), learners, here)
    never_ended, _ = program(jax.random.key(2), learners, here, 0.0)
    for one, other in zip(jax.tree.leaves(never_ended), jax.tree.leaves(after), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-4, atol=1e-5)
    ended = jax.tree.leaves(trained[0].critics)
    others = zip(jax.tree.leaves(after.critics), ended, strict=True)
    assert all(np.abs(one - other).max((1, 2)).min() > 1e-3 for one, other in others if one.ndim > 2)


def test_nothing_changes_once_all_have_stopped(learners) -> None:
    after, losses = program(jax.random.key(2), learners, jnp.ones(SKILLS, bool))
    assert changed(learners, after) == [False] * SKILLS
    assert np.isnan(losses["critic_loss"]).all()


def test_work_is_skipped_lane_by_lane_under_vmap() -> None:
    skip = jnp.array([True, False, True])
    result = jax.vmap(lambda skip, x: run_unless(skip, lambda y: y + 10, x))(skip, jnp.arange(3.0))
    assert result.tolist() == [0, 11, 2]


def test_skipped_work_is_not_done() -> None:
    calls = []

    def work(x):
        jax.debug.callback(lambda: calls.append(1))
        return x + 1

    program = jax.jit(lambda skip, x: run_unless(skip, work, x))
    for skip, expected in ((True, 0), (False, 1)):
        program(skip, jnp.float32(0)).block_until_ready()
        jax.effects_barrier()
        assert len(calls) == expected


class Counting(TD3):
    """Learns nothing, and tells when it is run."""

    calls: list[int]

    def update(self, state, batches, key):
        jax.debug.callback(lambda: self.calls.append(1))
        return state, {"critic_loss": jnp.zeros(()), "actor_loss": jnp.zeros(())}


def test_no_update_is_computed_once_all_have_stopped(learners) -> None:
    counting = Counting(LEARNER.config, OBSERVATION, ACTION)
    counting.calls = []
    program = jax.jit(
        lambda stopped: train(jax.random.key(2), learners, stopped, updates=4, learner=counting)
    )
    for stopped, runs in ((True, False), (False, True)):
        jax.block_until_ready(program(jnp.full(SKILLS, stopped)))
        jax.effects_barrier()
        assert bool(counting.calls) == runs
