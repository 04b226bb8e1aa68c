"""COMA's steps: counterfactual values, baseline, targets."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from oracles import on_policy as oracle
from oracles.refusals import refusal, unhooked
from skillcrew.learners import coma
from skillcrew.learners.coma import COMA, COMALearnerConfig, counterfactual_advantage
from skillcrew.policies.memory import PolicyConfig

NETWORK = PolicyConfig(hidden=(8,), input_scaling="none", sharing="team")
LEARNING = COMA(
    COMALearnerConfig(minibatches=2, epochs=2, discount=0.9, trace=0.6), oracle.CHOOSERS, NETWORK, NETWORK
)


@pytest.fixture(scope="module")
def state():
    """After a few updates, so that nothing is even any more."""
    learned = jax.jit(LEARNING.init)(jax.random.key(0))
    for key in jax.random.split(jax.random.key(1), 4):
        learned, _ = jax.jit(LEARNING.update)(learned, oracle.lived(0), key)
    return learned


def test_an_advantage_is_the_value_of_what_was_chosen_less_the_mean_by_the_own_policy() -> None:
    values = jnp.array([[1.0, 4.0, -2.0]])
    probabilities = jnp.array([[0.5, 0.25, 0.25]])
    found = [
        float(counterfactual_advantage(values, probabilities, jnp.array([choice]))[0]) for choice in range(3)
    ]
    assert found == pytest.approx([0.0, 3.0, -3.0])


def test_the_baseline_does_not_depend_on_what_the_agent_itself_did(state) -> None:
    """Nor does any of its counterfactual values; each depends on what others did."""
    experience = oracle.lived(0)

    def values(taken):
        return LEARNING._critics(state.critics, experience.observation[:-1], LEARNING._of_others(taken))

    other = experience.taken.at[:, :, 1].set((experience.taken[:, :, 1] + 1) % oracle.CHOICES)
    changed = jnp.abs(values(other) - values(experience.taken)).max((0, 1, 3))
    assert changed[1] == 0
    assert changed[0] > 1e-4
    assert changed[2] > 1e-4


def test_values_of_all_choices_come_in_one_pass(state) -> None:
    experience = oracle.lived(0)
    others = LEARNING._of_others(experience.taken)
    found = LEARNING._critics(state.critics, experience.observation[:-1], others)
    assert found.shape == (oracle.TIME, oracle.WORLDS, oracle.AGENTS, oracle.CHOICES)
    spread = np.asarray(found.std(-1))
    assert (spread > 1e-4).all()


def test_targets_are_lambda_returns_of_the_values_of_what_was_done(state) -> None:
    experience = oracle.lived(0)
    after, lived = LEARNING._judged(state, experience, jnp.array(0.2), jax.random.key(3))
    # What was done in lived steps is certain; after a time limit something was drawn.
    drawn = LEARNING._distribution(state.policies, experience.observation, jnp.array(0.2)).sample(
        jax.random.key(3)
    )
    done = np.asarray(drawn).copy()
    mask = np.asarray(experience.mask)
    done[:-1][mask] = np.asarray(experience.taken)[mask]
    every = LEARNING._critics(state.critics, experience.observation, LEARNING._of_others(jnp.asarray(done)))
    value = state.scale.returns(jnp.take_along_axis(every, done[..., None], axis=-1)[..., 0])
    expected = oracle.lambda_returns(experience, np.asarray(value), 0.9, 0.6)
    found = np.asarray(after.scale.returns(lived.target))
    np.testing.assert_allclose(found[mask], expected[mask], rtol=1e-3, atol=1e-4)


def test_policies_climb_what_is_better_than_average() -> None:
    """Of four choices the third is worth more, whatever the others do."""
    quick = COMALearnerConfig(minibatches=2, learning_rate=3e-3)
    learning = COMA(quick, oracle.CHOOSERS, NETWORK, NETWORK)
    experience = oracle.lived(0)
    state = jax.jit(learning.init)(jax.random.key(0))
    values = jnp.zeros((oracle.TIME, oracle.WORLDS, oracle.AGENTS, oracle.CHOICES)).at[..., 2].set(1.0)
    floor = jnp.zeros(())
    step = jax.jit(learning._policy_step)
    for _ in range(40):
        state, _ = step(state, experience, values, floor, jnp.ones(()))
    probabilities = LEARNING._distribution(state.policies, experience.observation, floor).probabilities()
    of_third = probabilities[..., 2][:-1][experience.mask]
    assert (of_third > 0.27).all()
    assert of_third.mean() > 0.4


def test_the_floor_falls_with_the_episodes(state) -> None:
    config = COMALearnerConfig(first_floor=0.5, last_floor=0.1, floor_episodes=40)
    learning = COMA(config, oracle.CHOOSERS, NETWORK, NETWORK)
    floors = [
        float(learning.floor(dataclasses.replace(state, episodes=jnp.array(episodes))))
        for episodes in (0.0, 10.0, 40.0, 999.0)
    ]
    assert floors == pytest.approx([0.5, 0.4, 0.1, 0.1])
    assert float(state.episodes) == 4 * oracle.WORLDS


def test_a_masked_step_changes_nothing() -> None:
    states = [
        jax.jit(LEARNING.update)(
            LEARNING.init(jax.random.key(0)), oracle.lived(0, padding=padding), jax.random.key(1)
        )
        for padding in (0.0, float("nan"))
    ]
    for left, right in zip(*map(jax.tree.leaves, states), strict=True):
        np.testing.assert_array_equal(left, right)


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        ({"trace": 2.0}, "coma.trace = 2.0: give a number from 0 to 1"),
        ({"first_floor": 1.0}, "coma.first_floor = 1.0: give a share from 0 to below 1"),
        ({"last_floor": -0.1}, "coma.last_floor = -0.1: give a share from 0 to below 1"),
        ({"floor_episodes": 0}, "coma.floor_episodes = 0: give at least 1"),
    ],
)
def test_refuses_what_cannot_be_meant(fields: dict, expected: str) -> None:
    assert refusal(unhooked(coma).COMALearnerConfig, **fields) == expected
