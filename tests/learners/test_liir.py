"""LIIR's two levels: policies follow a learned reward, which follows the team's through them."""

import dataclasses
import functools

import jax
import jax.flatten_util
import jax.numpy as jnp
import numpy as np
import pytest

from oracles import on_policy as oracle
from oracles.refusals import refusal, unhooked
from skillcrew.learners import liir
from skillcrew.learners.liir import LIIR, LIIRLearnerConfig, LIIRState
from skillcrew.policies.memory import PolicyConfig

NETWORK = PolicyConfig(hidden=(6,), input_scaling="none", sharing="team")


def learner(**fields) -> LIIR:
    config = LIIRLearnerConfig(**{"minibatches": 2, "epochs": 2, "weight": 0.5, **fields})
    return LIIR(config, oracle.CHOOSERS, NETWORK, NETWORK)


@functools.cache
def begun() -> LIIRState:
    """How every learner begins, whatever its rates and weights are."""
    return jax.jit(learner().init)(jax.random.key(0))


def test_the_outer_gradient_is_that_of_finite_differences() -> None:
    """In double precision, of the team's objective after the policies' step, by 12 weights of the reward."""
    with jax.enable_x64(True):
        learning = learner()
        experience = jax.tree.map(
            lambda leaf: leaf.astype(jnp.float64) if jnp.issubdtype(leaf.dtype, jnp.floating) else leaf,
            oracle.lived(0),
        )
        state, update = jax.jit(learning.init)(jax.random.key(0)), jax.jit(learning.update)
        # A few steps first: Adam's very first one does not depend on the gradient's size.
        for key in jax.random.split(jax.random.key(1), 3):
            state, _ = update(state, experience, key)
        _, lived = jax.jit(learning._judged)(state, experience)
        flat, restore = jax.flatten_util.ravel_pytree(state.intrinsic)

        @jax.jit
        def objective(weights):
            policies, _, _ = learning.after_policy_step(state, restore(weights), lived)
            return learning.team_objective(policies, lived)

        gradient = np.asarray(jax.grad(objective)(flat))
        largest = np.argsort(-np.abs(gradient))[:12]
        step = 1e-4
        differences = [
            float(objective(flat.at[place].add(step)) - objective(flat.at[place].add(-step))) / (2 * step)
            for place in largest
        ]
        assert np.abs(gradient).max() > 1e-7
        np.testing.assert_allclose(gradient[largest], differences, rtol=1e-3)


@pytest.mark.parametrize("paid", [True, False])
def test_policies_follow_the_learned_reward_once_the_team_is_paid(paid: bool) -> None:
    """One that is of the third choice alone; the team is paid at random, or never."""
    learning = learner(weight=20.0, learning_rate=3e-3, trace=0.0, discount=0.0)
    experience = oracle.lived(0)
    third = (experience.taken == 2).astype(jnp.float32)
    experience = dataclasses.replace(experience, reward=experience.reward * float(paid))
    state = begun()
    learning.intrinsic_reward = lambda intrinsic, lived: third
    _, lived = jax.jit(learning._judged)(state, experience)
    step = jax.jit(lambda policies_state: learning.after_policy_step(policies_state, state.intrinsic, lived))
    for _ in range(60):
        policies, optimiser, _ = step(state)
        state = dataclasses.replace(state, policies=policies, policy_optimiser=optimiser)
    said = learning._policies.distributions(state.policies, experience.observation[:-1]).probabilities()
    often = said[..., 2][experience.mask]
    assert (often > 0.3).all() if paid else (jnp.abs(often - 1 / oracle.CHOICES) < 0.02).all()


def test_where_the_team_is_paid_nothing_its_critics_errors_are_no_advantage() -> None:
    experience = oracle.lived(0)
    silent = dataclasses.replace(experience, reward=jnp.zeros_like(experience.reward))
    judged = jax.jit(learner()._judged)
    counts = experience.decides
    assert jnp.abs(judged(begun(), silent)[1].team_advantage[counts]).max() < 1e-3
    assert jnp.abs(judged(begun(), experience)[1].team_advantage[counts]).max() > 0.5


def test_the_learned_reward_comes_to_pay_what_the_team_is_paid_for() -> None:
    """The team is paid for the second choice of whoever makes it; after a while so is each agent."""
    learning = learner(intrinsic_learning_rate=1e-2, discount=0.0, trace=0.0)
    experience = oracle.lived(0)
    paid = ((experience.taken == 1) & experience.mask[..., None]).astype(jnp.float32)
    experience = dataclasses.replace(experience, reward=paid)
    state = begun()

    @jax.jit
    def gap(state):
        reward = learning.intrinsic_reward(state.intrinsic, experience)
        second = (experience.taken == 1) & experience.decides
        others = (experience.taken != 1) & experience.decides
        return reward.mean(where=second) - reward.mean(where=others)

    before = gap(state)
    update = jax.jit(learning.update)
    for key in jax.random.split(jax.random.key(1), 25):
        state, _ = update(state, experience, key)
    assert gap(state) > before + 0.3


def test_intrinsic_rewards_are_each_agents_own_and_bounded() -> None:
    learning, experience = learner(), oracle.lived(0)
    state = begun()
    reward = learning.intrinsic_reward(state.intrinsic, experience)
    assert (jnp.abs(reward) <= 1).all()
    other = dataclasses.replace(
        experience, taken=experience.taken.at[:, :, 1].set((experience.taken[:, :, 1] + 1) % oracle.CHOICES)
    )
    changed = jnp.abs(learning.intrinsic_reward(state.intrinsic, other) - reward).max((0, 1))
    assert (changed > 1e-5).tolist() == [False, True, False]


def test_a_masked_step_changes_nothing_and_nothing_is_infinite() -> None:
    learning = learner()
    state, update = begun(), jax.jit(learning.update)
    states = [
        update(state, oracle.lived(0, padding=padding), jax.random.key(1)) for padding in (0.0, float("nan"))
    ]
    for left, right in zip(*map(jax.tree.leaves, states), strict=True):
        np.testing.assert_array_equal(left, right)
        assert np.isfinite(np.asarray(left)).all()


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        ({"weight": 0.0}, "liir.weight = 0.0: give a positive number"),
        ({"intrinsic_learning_rate": -1.0}, "liir.intrinsic_learning_rate = -1.0: give a positive number"),
        ({"minibatches": 0}, "liir.minibatches = 0: give at least 1"),
    ],
)
def test_refuses_what_cannot_be_meant(fields: dict, expected: str) -> None:
    assert refusal(unhooked(liir).LIIRLearnerConfig, **fields) == expected
