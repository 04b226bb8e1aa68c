"""DQN: targets against a NumPy oracle, and tasks whose values are known."""

import dataclasses
import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from oracles.refusals import refusal
from skillcrew.learners.batch import Batch
from skillcrew.learners.dqn import DQN, DQNConfig, DQNState
from skillcrew.policies.action_values import ActionValues, best_action
from skillcrew.policies.memory import MemoryNetwork
from skillcrew.policies.network import NetworkConfig

OBSERVATION, CHOICES, DECISIONS, BATCH = 2, 3, 2, 5
CONFIG = DQNConfig(
    discount=0.5,
    soft_update=0.05,
    learning_rate=1e-2,
    batch_size=32,
    network=NetworkConfig(hidden=(16,), input_scaling="none"),
)


def random_batch(action_size: int) -> Batch:
    keys = jax.random.split(jax.random.key(4), 5)
    return Batch(
        jax.random.normal(keys[0], (BATCH, OBSERVATION)),
        jax.nn.one_hot(jax.random.randint(keys[1], (BATCH,), 0, action_size), action_size),
        jax.random.normal(keys[2], (BATCH,)),
        jax.random.normal(keys[3], (BATCH, OBSERVATION)),
        jnp.array([0.0, 1, 0, 0, 1]),
    )


def values(network: ActionValues, observation: np.ndarray, dueling: bool) -> np.ndarray:
    """In plain NumPy."""
    (first, last), (first_bias, last_bias) = network.network.weights, network.network.biases
    outputs = np.maximum(observation @ np.asarray(first) + first_bias, 0) @ np.asarray(last) + last_bias
    if not dueling:
        return outputs
    advantages = outputs[:-1]
    return outputs[-1] + advantages - advantages.mean()


@pytest.mark.parametrize("dueling", [False, True])
@pytest.mark.parametrize("double", [False, True])
@pytest.mark.parametrize("decisions", [1, DECISIONS])
def test_targets_are_those_of_the_papers(double, dueling, decisions):
    config = dataclasses.replace(CONFIG, double=double, dueling=dueling)
    learner = DQN(config, OBSERVATION, CHOICES * decisions, decisions=decisions)
    state = jax.jit(learner.init)(jax.random.key(0))
    other = jax.jit(learner.init)(jax.random.key(1))
    state = DQNState(state.actor, other.actor, state.optimiser)
    batch = random_batch(CHOICES * decisions)
    expected = []
    for index in range(BATCH):
        after = np.asarray(batch.next_observation[index])
        target = values(state.target_actor, after, dueling).reshape(decisions, CHOICES)
        judge = values(state.actor, after, dueling).reshape(decisions, CHOICES) if double else target
        future = sum(target[d, judge[d].argmax()] for d in range(decisions))
        ends = float(batch.terminated[index])
        expected.append(float(batch.reward[index]) + 0.5 * (1 - ends) * future)
    np.testing.assert_allclose(learner.target_values(state, batch), expected, rtol=1e-5, atol=1e-6)


def test_double_makes_a_difference_here():
    state = jax.jit(DQN(CONFIG, OBSERVATION, CHOICES).init)(jax.random.key(0))
    other = jax.jit(DQN(CONFIG, OBSERVATION, CHOICES).init)(jax.random.key(1))
    state = DQNState(state.actor, other.actor, state.optimiser)
    batch = random_batch(CHOICES)
    plain, double = (
        DQN(dataclasses.replace(CONFIG, double=double), OBSERVATION, CHOICES) for double in (False, True)
    )
    assert (plain.target_values(state, batch) > double.target_values(state, batch)).any()


@functools.cache
def trained(dueling: bool) -> DQNState:
    """At -1 the first action pays 1 and ends; at 1 the last one leads back to -1, and nothing pays."""
    learner = DQN(dataclasses.replace(CONFIG, dueling=dueling), OBSERVATION, CHOICES)

    def one_round(state, key):
        key_place, key_action = jax.random.split(key)
        shape = (1, CONFIG.batch_size)
        place = jnp.sign(jax.random.uniform(key_place, shape, minval=-1.0))
        action = jax.random.randint(key_action, shape, 0, CHOICES)
        ends = (place < 0) & (action == 0)
        goes_back = (place > 0) & (action == CHOICES - 1)
        after = jnp.where(goes_back, -1.0, place)
        still = jnp.zeros_like(place)
        batch = Batch(
            jnp.stack([place, still], -1),
            jax.nn.one_hot(action, CHOICES),
            ends.astype(jnp.float32),
            jnp.stack([after, still], -1),
            ends.astype(jnp.float32),
        )
        return learner.update(state, batch, key)

    def train(key):
        state = learner.init(key)
        return jax.lax.scan(one_round, state, jax.random.split(key, 1500))[0]

    return jax.jit(train)(jax.random.key(0))


@pytest.mark.parametrize("dueling", [False, True])
def test_it_learns_what_actions_are_worth(dueling):
    actor = trained(dueling).actor
    # Whoever dawdles waits a step for the same: half of it.
    np.testing.assert_allclose(actor(jnp.array([-1.0, 0])), [1, 0.5, 0.5], atol=0.05)
    np.testing.assert_allclose(actor(jnp.array([1.0, 0])), [0.25, 0.25, 0.5], atol=0.05)


def test_the_target_follows_slowly():
    learner = DQN(CONFIG, OBSERVATION, CHOICES)
    state = jax.jit(learner.init)(jax.random.key(0))
    batch = jax.tree.map(lambda leaf: leaf[None], random_batch(CHOICES))
    after, losses = learner.update(state, batch, jax.random.key(0))
    moved = jax.tree.map(lambda new, old: old + 0.05 * (new - old), after.actor, state.target_actor)
    for found, expected in zip(jax.tree.leaves(after.target_actor), jax.tree.leaves(moved), strict=True):
        np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-7)
    assert set(losses) == set(learner.losses)


@pytest.mark.parametrize("heads", [0, 2])
@pytest.mark.parametrize("dueling", [False, True])
def test_a_policy_ranks_actions_as_their_values_do(heads, dueling):
    size = OBSERVATION + heads
    draw = lambda key: ActionValues.create(key, size, CHOICES, CONFIG.network, heads, dueling)  # noqa: E731
    networks = jax.vmap(draw)(jax.random.split(jax.random.key(0), 4))
    policies = jax.vmap(MemoryNetwork.of_actor)(networks)
    seen = jax.random.normal(jax.random.key(2), (4, size))
    ranked = jax.vmap(lambda network, x: network(x, jnp.zeros(0))[0])(policies, seen)
    valued = jax.vmap(lambda network, x: network(x))(networks, seen)
    assert ranked.shape == (4, CHOICES)
    np.testing.assert_array_equal(best_action(ranked, CHOICES), best_action(valued, CHOICES))
    np.testing.assert_allclose(jnp.diff(ranked), jnp.diff(valued), rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        ({"batch_size": 0}, "dqn.batch_size = 0: give at least 1"),
        ({"learning_rate": 0.0}, "dqn.learning_rate = 0.0: give a positive number"),
        ({"discount": 1.0}, "dqn.discount = 1.0: give a number from 0 to below 1"),
        ({"soft_update": 0.0}, "dqn.soft_update = 0.0: give a share above 0 and up to 1"),
    ],
)
def test_bad_values_are_refused(fields, expected):
    assert refusal(lambda: DQNConfig(**fields)) == expected
