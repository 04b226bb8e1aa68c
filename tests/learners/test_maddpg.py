"""MADDPG's and MATD3's updates against NumPy, in double precision; who sees what, who learns from what."""

import dataclasses
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from oracles import maddpg as oracle
from oracles.refusals import refusal, unhooked
from oracles.td3 import Net
from skillcrew.learners import maddpg
from skillcrew.learners.batch import Batch
from skillcrew.learners.maddpg import MADDPGLearner, MADDPGLearnerConfig
from skillcrew.learners.td3 import TD3State
from skillcrew.policies.network import NetworkConfig

AGENTS, OBSERVATION, ACTION, BATCH, ROUNDS = 3, 4, 2, 7, 2

# Large steps, noise that meets its bound, and actions that meet theirs.
PLAIN = MADDPGLearnerConfig(
    discount=0.8,
    soft_update=0.3,
    actor_learning_rate=0.05,
    critic_learning_rate=0.03,
    batch_size=BATCH,
    saturation_penalty=0.2,
    target_noise_clip=0.7,
    temperature=0.6,
    network=NetworkConfig(hidden=(6, 5), input_scaling="none"),
)
TWINS = dataclasses.replace(PLAIN, critics=2, policy_delay=2, target_noise=0.9)
CASES: dict[str, tuple[MADDPGLearnerConfig, dict[str, Any]]] = {
    "maddpg": (PLAIN, {"actors": AGENTS, "whose": AGENTS}),
    "matd3, ensembles": (TWINS, {"actors": AGENTS, "whose": AGENTS, "policies": 2}),
    "matd3, a critic and an actor for all": (TWINS, {}),
    "discrete, a critic for all, ensembles": (PLAIN, {"actors": AGENTS, "policies": 3, "choices": ACTION}),
}


def draw_batches(config: MADDPGLearnerConfig, policies: int, discrete: bool, seed: int) -> dict[str, Any]:
    rng, shape = np.random.default_rng(seed), (ROUNDS, config.policy_delay, BATCH, AGENTS)
    done = (rng.uniform(size=(*shape[:-1], 1)) < 0.4).astype(float)
    taken = np.eye(ACTION)[rng.integers(0, ACTION, shape)]
    return {
        "observation": rng.normal(size=(*shape, OBSERVATION)),
        "action": taken if discrete else rng.uniform(-1, 1, (*shape, ACTION)),
        "reward": rng.normal(size=shape),
        "next_observation": rng.normal(size=(*shape, OBSERVATION)),
        "terminated": np.broadcast_to(done, shape).copy(),
        "acted": rng.integers(0, policies, shape).astype(np.int32),
    }


def nets_of(network: Any) -> list[list[Net]]:
    """Those of two leading axes."""
    first, second = network.weights[0].shape[:2]
    return [
        [
            Net([np.array(w[i, j]) for w in network.weights], [np.array(b[i, j]) for b in network.biases])
            for j in range(second)
        ]
        for i in range(first)
    ]


def assert_same(network: Any, expected: list[list[Net]]) -> None:
    for some, others in zip(nets_of(network), expected, strict=True):
        for one, other in zip(some, others, strict=True):
            for mine, theirs in zip(one.weights + one.biases, other.weights + other.biases, strict=True):
                np.testing.assert_allclose(mine, theirs, rtol=1e-7, atol=1e-9)


@pytest.mark.parametrize("name", CASES)
def test_updates_equal_the_equations(name: str) -> None:
    config, kinds = CASES[name]
    with jax.enable_x64(True):
        learner = MADDPGLearner(config, AGENTS, OBSERVATION, ACTION, **kinds)
        discrete, shape = "choices" in kinds, (BATCH, AGENTS, ACTION)
        state, update = jax.jit(learner.init)(jax.random.key(0)), jax.jit(learner.update)
        batches = draw_batches(config, kinds.get("policies", 1), discrete, 1)
        expected = oracle.Crew(nets_of(state.actor.network), nets_of(state.critics.network), config, discrete)
        assert len(expected.critics[0]) == kinds.get("whose", 1)
        for number in range(ROUNDS):
            now = {field: values[number] for field, values in batches.items()}
            key = jax.random.key(10 + number)
            state, losses = update(state, Batch(**jax.tree.map(jnp.asarray, now)), key)
            # Noise is the one thing that both must share.
            *keys, key_actors = jax.random.split(key, config.policy_delay + 1)
            critic_losses = []
            for inner, key_critics in enumerate(keys):
                steps = oracle.Steps(**{field: values[inner] for field, values in now.items()})
                key_draw, key_noise = jax.random.split(key_critics)
                normal = np.asarray(jax.random.normal(key_noise, shape))
                gumbel = np.asarray(jax.random.gumbel(key_draw, shape))
                critic_losses.append(expected.update_critics(steps, normal, gumbel))
            gumbel = np.asarray(jax.random.gumbel(key_actors, shape))
            actor_loss = expected.update_actors_and_targets(steps, gumbel)
            assert_same(state.actor.network, expected.actors)
            assert_same(state.critics.network, expected.critics)
            assert_same(state.target_actor.network, expected.target_actors)
            assert_same(state.target_critics.network, expected.target_critics)
            assert float(losses["critic_loss"]) == pytest.approx(np.mean(critic_losses), rel=1e-7)
            assert float(losses["actor_loss"]) == pytest.approx(actor_loss, rel=1e-7)


@pytest.fixture(scope="module", params=["agent", "team"])
def crew(request) -> tuple[MADDPGLearner, TD3State]:
    """With two policies for each agent, and a critic for each or one for all."""
    whose = AGENTS if request.param == "agent" else 1
    learner = MADDPGLearner(PLAIN, AGENTS, OBSERVATION, ACTION, actors=AGENTS, whose=whose, policies=2)
    return learner, jax.jit(learner.init)(jax.random.key(1))


def one_batch(seed: int = 4) -> Batch:
    drawn = draw_batches(PLAIN, 2, False, seed)
    single = {name: jnp.asarray(values[0, 0]) for name, values in drawn.items()}
    return Batch(**{n: v if n == "acted" else v.astype(jnp.float32) for n, v in single.items()})


def test_a_critic_sees_everybody_and_an_actor_its_own_observation(crew) -> None:
    learner, state = crew
    batch = one_batch()

    def values(observation, action):
        return learner._values(state.critics, observation[None], action[None])[0, 0]

    seen, done = jax.jit(jax.jacrev(values, argnums=(0, 1)))(batch.observation[0], batch.action[0])
    # Of each agent's value by each agent's observation and action.
    assert (jnp.abs(seen).max(-1) > 0).all()
    assert (jnp.abs(done).max(-1) > 0).all()

    def outputs(observation):
        return learner._outputs(state.actor, observation[None], jax.tree.map(lambda leaf: leaf[:1], batch))[0]

    depends = jnp.abs(jax.jit(jax.jacrev(outputs))(batch.observation[0])).max((1, 3)) > 0
    np.testing.assert_array_equal(depends, np.eye(AGENTS, dtype=bool))


def test_only_the_policy_that_acted_learns(crew) -> None:
    learner, state = crew
    batch = one_batch()
    acted = jnp.broadcast_to(jnp.array([0, 1, 0], jnp.int32), batch.acted.shape)
    batch = dataclasses.replace(batch, acted=acted)
    after, _ = jax.jit(learner._update_actor)(state, batch, jax.random.key(0))
    moved = after.actor.network.weights[0] != state.actor.network.weights[0]
    np.testing.assert_array_equal(moved.any((2, 3)), [[True, False], [False, True], [True, False]])


def test_a_value_ends_where_the_task_is_done_and_not_where_time_is_up(crew) -> None:
    learner, state = crew
    batch = one_batch()
    done = jnp.zeros_like(batch.terminated).at[0].set(1.0)
    batch = dataclasses.replace(batch, terminated=done)
    targets = jax.jit(learner.target_values)(state, batch, jax.random.key(0))
    np.testing.assert_array_equal(targets[0], batch.reward[0])
    assert (targets[1:] != batch.reward[1:]).all()


def test_matd3_has_twins_a_delay_and_smoothed_targets_and_maddpg_none_of_them() -> None:
    for config, expected in (
        (MADDPGLearnerConfig(), (1, 1, 0.0)),
        (MADDPGLearnerConfig.matd3(discount=0.5), (2, 2, 0.2)),
    ):
        assert (config.critics, config.policy_delay, config.target_noise) == expected
    assert MADDPGLearnerConfig.matd3(discount=0.5).discount == 0.5


def test_a_temperature_that_cannot_be_meant_is_refused() -> None:
    for value in (0.0, -0.5, float("nan")):
        message = refusal(unhooked(maddpg).MADDPGLearnerConfig, temperature=value)
        assert message == f"learner.temperature = {value}: give a positive number"
    assert "learner.discount = 1.0" in refusal(unhooked(maddpg).MADDPGLearnerConfig, discount=1.0)
