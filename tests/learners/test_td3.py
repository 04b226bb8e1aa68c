"""TD3's update against NumPy, in double precision, so that what is left over is no rounding."""

import dataclasses
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from oracles import td3 as oracle
from skillcrew.learners.batch import Batch
from skillcrew.learners.td3 import TD3, TD3Config, TD3State
from skillcrew.policies.network import NetworkConfig

OBSERVATION, ACTION, BATCH, ROUNDS = 5, 2, 7, 3

# Large steps, noise that meets its bound, and actions that meet theirs.
PLAIN = TD3Config(
    discount=0.8,
    soft_update=0.3,
    actor_learning_rate=0.05,
    critic_learning_rate=0.03,
    batch_size=BATCH,
    target_noise=0.9,
    target_noise_clip=0.7,
    network=NetworkConfig(hidden=(6, 4), input_scaling="none"),
)
CONFIGS = {
    "td3": PLAIN,
    "three critics, delay of three, penalty": dataclasses.replace(
        PLAIN,
        critics=3,
        policy_delay=3,
        saturation_penalty=0.4,
        network=NetworkConfig(hidden=(6,), input_scaling="sqrt"),
    ),
    "ddpg": TD3Config.ddpg(
        discount=0.8, soft_update=0.3, batch_size=BATCH, network=NetworkConfig((6, 4), input_scaling="none")
    ),
}


def draw_batches(config: TD3Config, rng: np.random.Generator) -> dict[str, np.ndarray]:
    shape = (ROUNDS, config.policy_delay, BATCH)
    return {
        "observation": rng.normal(size=(*shape, OBSERVATION)),
        "action": rng.uniform(-1, 1, (*shape, ACTION)),
        "reward": rng.normal(size=shape),
        "next_observation": rng.normal(size=(*shape, OBSERVATION)),
        "terminated": (rng.uniform(size=shape) < 0.4).astype(float),
    }


def net_of(network: Any, index: tuple[int, ...] = ()) -> oracle.Net:
    return oracle.Net(
        [np.array(weight[index]) for weight in network.weights],
        [np.array(bias[index]) for bias in network.biases],
    )


def assert_same_net(network: Any, index: tuple[int, ...], expected: oracle.Net) -> None:
    actual = net_of(network, index)
    for one, other in zip(actual.weights + actual.biases, expected.weights + expected.biases, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-8, atol=1e-10)


def assert_same_state(state: TD3State, expected: oracle.Learner) -> None:
    assert_same_net(state.actor.network, (), expected.actor)
    assert_same_net(state.target_actor.network, (), expected.target_actor)
    for j, (critic, target) in enumerate(zip(expected.critics, expected.target_critics, strict=True)):
        assert_same_net(state.critics.network, (j,), critic)
        assert_same_net(state.target_critics.network, (j,), target)


@pytest.mark.parametrize("name", CONFIGS)
def test_updates_equal_the_equations(name: str) -> None:
    config = CONFIGS[name]
    with jax.enable_x64(True):
        learner = TD3(config, OBSERVATION, ACTION)
        state = jax.jit(learner.init)(jax.random.key(0))
        update = jax.jit(learner.update)
        batches = draw_batches(config, np.random.default_rng(1))
        expected = oracle.Learner(
            net_of(state.actor.network),
            [net_of(state.critics.network, (j,)) for j in range(config.critics)],
            config,
            config.network.input_scaling == "sqrt",
        )
        for number in range(ROUNDS):
            now = {field: values[number] for field, values in batches.items()}
            key = jax.random.key(10 + number)
            state, losses = update(state, Batch(**jax.tree.map(jnp.asarray, now)), key)
            # The target noise is the one draw that both must share.
            keys = jax.random.split(key, config.policy_delay)
            critic_losses = []
            for inner in range(config.policy_delay):
                batch = oracle.Transitions(**{field: values[inner] for field, values in now.items()})
                normal = np.asarray(jax.random.normal(keys[inner], (BATCH, ACTION)))
                critic_losses.append(expected.update_critics(batch, normal))
            actor_loss = expected.update_actor_and_targets(batch)
            assert_same_state(state, expected)
            assert float(losses["critic_loss"]) == pytest.approx(np.mean(critic_losses), rel=1e-8)
            assert float(losses["actor_loss"]) == pytest.approx(actor_loss, rel=1e-8)


def test_ddpg_has_one_critic_no_delay_and_no_target_noise() -> None:
    config = TD3Config.ddpg(discount=0.5)
    assert (config.critics, config.policy_delay, config.target_noise) == (1, 1, 0.0)
    assert config.discount == 0.5


@pytest.fixture(scope="module")
def small() -> TD3:
    return TD3(CONFIGS["ddpg"], OBSERVATION, ACTION)


def test_targets_start_as_copies_with_memory_of_their_own(small: TD3) -> None:
    state = jax.jit(small.init)(jax.random.key(3))
    pairs = [(state.actor, state.target_actor), (state.critics, state.target_critics)]
    for network, target in pairs:
        for one, other in zip(jax.tree.leaves(network), jax.tree.leaves(target), strict=True):
            np.testing.assert_array_equal(one, other)
            assert one.unsafe_buffer_pointer() != other.unsafe_buffer_pointer()


def test_twin_critics_start_apart() -> None:
    state = jax.jit(TD3(PLAIN, OBSERVATION, ACTION).init)(jax.random.key(3))
    first = state.critics.network.weights[0]
    assert first.shape == (2, OBSERVATION + ACTION, 6)
    assert bool((first[0] != first[1]).all())


def test_learners_stacked_by_vmap_equal_each_alone(small: TD3) -> None:
    skills = 3
    keys = jax.random.split(jax.random.key(5), skills)
    states = jax.jit(jax.vmap(small.init))(keys)
    rng = np.random.default_rng(2)
    drawn = {field: [] for field in ("observation", "action", "reward", "next_observation", "terminated")}
    for _ in range(skills):
        for field, values in draw_batches(small.config, rng).items():
            drawn[field].append(values[0])
    batches = Batch(**{field: jnp.asarray(np.stack(v), jnp.float32) for field, v in drawn.items()})
    together, losses = jax.jit(jax.vmap(small.update))(states, batches, keys)
    alone = jax.jit(small.update)
    # In NumPy: JAX would compile each way to take one of so many.
    states, batches, together, losses = jax.device_get((states, batches, together, losses))
    for skill in range(skills):
        inputs = jax.tree.map(lambda leaf, skill=skill: leaf[skill], (states, batches))
        expected = alone(*inputs, keys[skill])
        actual = jax.tree.map(lambda leaf, skill=skill: leaf[skill], (together, losses))
        for one, other in zip(jax.tree.leaves(actual), jax.tree.leaves(expected), strict=True):
            np.testing.assert_allclose(one, other, rtol=1e-4, atol=1e-5)
