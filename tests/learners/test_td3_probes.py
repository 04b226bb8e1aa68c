"""TD3 learns tasks whose values are known; each fails for a reason of its own."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from oracles.probes import ACTION, DISCOUNT, OBSERVATION, OPTIMUM, PROBES, batches
from skillcrew.learners.td3 import TD3, TD3Config, TD3State
from skillcrew.policies.network import NetworkConfig

CONFIG = TD3Config(
    discount=DISCOUNT,
    soft_update=0.05,
    actor_learning_rate=3e-3,
    critic_learning_rate=1e-2,
    batch_size=64,
    network=NetworkConfig(hidden=(32,), input_scaling="none"),
)


@functools.cache
def trained() -> TD3State:
    """One learner per probe, all trained by one compiled loop."""
    learner = TD3(CONFIG, OBSERVATION, ACTION)

    def one_round(learners, key):
        key_batch, key_update = jax.random.split(key)
        drawn = batches(key_batch, CONFIG.policy_delay, CONFIG.batch_size)
        keys = jax.random.split(key_update, len(PROBES))
        return jax.vmap(learner.update)(learners, drawn, keys)[0], None

    @jax.jit
    def train(key):
        key_init, key_train = jax.random.split(key)
        learners = jax.vmap(learner.init)(jax.random.split(key_init, len(PROBES)))
        return jax.lax.scan(one_round, learners, jax.random.split(key_train, 2000))[0]

    return train(jax.random.key(0))


def action_and_values(probe: str, where: float) -> tuple[float, np.ndarray]:
    """The actor's action and what each critic thinks of it."""
    one = jax.tree.map(lambda leaf: leaf[PROBES.index(probe)], trained())
    observation = jnp.array([where, 0.0])
    action = one.actor(observation)
    return float(action[0]), np.asarray(jax.vmap(lambda critic: critic(observation, action))(one.critics))


@pytest.mark.parametrize(
    ("probe", "where", "value"),
    [
        ("constant", 0.0, 1.0),
        ("by observation", 1.0, 1.0),
        ("by observation", -1.0, -1.0),
        ("two steps", 1.0, 1.0),
        ("two steps", 0.0, DISCOUNT),
        ("cut off", 0.0, 1 / (1 - DISCOUNT)),
        ("by action", 0.0, 0.0),
        ("by both", 1.0, 0.0),
        ("by both", -1.0, 0.0),
    ],
)
def test_critics_find_the_value(probe: str, where: float, value: float) -> None:
    np.testing.assert_allclose(action_and_values(probe, where)[1], value, atol=0.06)


@pytest.mark.parametrize(
    ("probe", "where", "best"), [("by action", 0.0, OPTIMUM), ("by both", 1.0, 0.5), ("by both", -1.0, -0.5)]
)
def test_actor_finds_the_best_action(probe: str, where: float, best: float) -> None:
    assert action_and_values(probe, where)[0] == pytest.approx(best, abs=0.12)
