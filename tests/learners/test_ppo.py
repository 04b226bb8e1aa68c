"""PPO's steps, against NumPy and by what they may depend on."""

import dataclasses
import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from oracles import on_policy as oracle
from oracles.refusals import refusal, unhooked
from skillcrew.learners import ppo
from skillcrew.learners.on_policy.experience import Experience
from skillcrew.learners.on_policy.networks import Players, View
from skillcrew.learners.ppo import PPO, PPOConfig, PPOState
from skillcrew.policies.memory import PolicyConfig

NETWORK = PolicyConfig(hidden=(8,), input_scaling="none", sharing="team")


@functools.cache
def learner(players: Players = oracle.CHOOSERS, view: View = "joint", memory: int = 0, **fields) -> PPO:
    network = dataclasses.replace(NETWORK, memory=memory)
    return PPO(PPOConfig(**{"minibatches": 2, "epochs": 2, **fields}), players, network, network, view)


@functools.cache
def programs(learning: PPO) -> tuple:
    return jax.jit(learning.init), jax.jit(learning.update)


def trained(learning: PPO, experience: Experience, times: int = 1) -> PPOState:
    init, update = programs(learning)
    state = init(jax.random.key(0))
    for key in jax.random.split(jax.random.key(1), times):
        state, _ = update(state, experience, key)
    return state


@pytest.mark.parametrize("players", [oracle.CHOOSERS, oracle.MOVERS])
def test_the_clipped_objective_is_the_papers(players: Players) -> None:
    learning = learner(players, clip=0.1, entropy=0.03)
    experience = oracle.lived(0, players)
    state = trained(learning, experience)
    _, lived = learning._judged(state, experience)
    # What was thought when it was lived is not what policies think now.
    shift = 0.3 * jax.random.normal(jax.random.key(4), lived.log_probability.shape)
    lived = dataclasses.replace(lived, log_probability=lived.log_probability + shift)
    loss, entropy = learning._policy_loss(state.policies, lived)

    now, spread = (np.asarray(each) for each in learning._policies.of_taken(state.policies, experience))
    ratio = np.exp(now - np.asarray(lived.log_probability))
    advantage, decides = np.asarray(lived.advantage), np.asarray(experience.decides)
    gained, outside = [], 0
    for place in np.argwhere(decides):
        r, a = ratio[tuple(place)], advantage[tuple(place)]
        gained.append(min(r * a, min(max(r, 0.9), 1.1) * a))
        outside += not 0.9 < r < 1.1
    assert outside > 10
    expected = -np.mean(gained) - 0.03 * spread[decides].mean()
    assert float(loss) == pytest.approx(expected, rel=1e-4)
    assert float(entropy) == pytest.approx(spread[decides].mean(), rel=1e-4)


def test_advantages_are_of_the_critics_values_and_targets_their_sum() -> None:
    learning = learner(discount=0.9, trace=0.6)
    experience = oracle.lived(0)
    state = trained(learning, experience)
    before = state.scale
    value = np.asarray(before.returns(learning._critics.values(state.critics, experience.observation)))
    state, lived = learning._judged(state, experience)
    expected = oracle.advantages(experience, value, 0.9, 0.6)
    decides, mask = np.asarray(experience.decides), np.asarray(experience.mask)
    counted = expected[decides]
    paid = oracle.advantages(experience, np.zeros_like(value), 0.9, 1.0)[decides].std()
    scale = max(counted.std(), counted.std() ** 2 / paid)
    np.testing.assert_allclose(
        np.asarray(lived.advantage)[decides], (counted - counted.mean()) / scale, atol=1e-3
    )
    target = np.asarray(state.scale.returns(lived.target))
    np.testing.assert_allclose(target[mask], (expected + value[:-1])[mask], rtol=1e-3, atol=1e-4)
    assert float(state.scale.mean) != float(before.mean)


@pytest.mark.parametrize("memory", [0, 4])
def test_a_masked_step_changes_nothing(memory: int) -> None:
    learning = learner(memory=memory)
    one, other = (trained(learning, oracle.lived(0, padding=padding)) for padding in (0.0, float("nan")))
    for left, right in zip(jax.tree.leaves(one), jax.tree.leaves(other), strict=True):
        np.testing.assert_array_equal(left, right)
    # Nor does a step at which an agent had no choice change its policy, but it does teach critics.
    experience = oracle.lived(0)
    taken = jnp.where(experience.decides, experience.taken, (experience.taken + 1) % oracle.CHOICES)
    changed = trained(learning, dataclasses.replace(experience, taken=taken))
    for left, right in zip(jax.tree.leaves(one.policies), jax.tree.leaves(changed.policies), strict=True):
        np.testing.assert_array_equal(left, right)


@pytest.mark.parametrize(("view", "seen"), [("own", [1]), ("joint", [0, 1, 2])])
def test_critics_see_their_own_agent_or_all_and_policies_their_own_alone(view: View, seen: list) -> None:
    learning = learner(view=view)
    experience = oracle.lived(0)
    state = trained(learning, experience, times=3)
    moved = experience.observation.at[:, :, 1].add(0.5)

    def who_changes(function) -> list[int]:
        change = jnp.abs(function(moved) - function(experience.observation))
        return np.flatnonzero(
            np.asarray(change.reshape(*change.shape[:3], -1).max((0, 1, 3)) > 1e-6)
        ).tolist()

    assert who_changes(lambda x: learning._critics.values(state.critics, x)) == seen
    assert who_changes(lambda x: learning._policies.distributions(state.policies, x).logits) == [1]


def test_a_joint_critic_is_told_whose_value_is_asked() -> None:
    learning = learner(view="joint")
    state = jax.jit(learning.init)(jax.random.key(0))
    values = learning._critics.values(state.critics, oracle.lived(0).observation)
    assert (jnp.abs(values[..., 0] - values[..., 1]) > 1e-4).all()


def test_probabilities_do_not_move_farther_than_the_clip_lets_them() -> None:
    """With 40 epochs on the same episodes."""
    experience = oracle.lived(0)

    def moved(clip: float) -> float:
        learning = learner(clip=clip, epochs=40, minibatches=1, learning_rate=3e-3, entropy=0.0)
        state, first = trained(learning, experience), programs(learning)[0](jax.random.key(0))
        before = learning._policies.of_taken(first.policies, experience)[0]
        ratio = jnp.exp(learning._policies.of_taken(state.policies, experience)[0] - before)
        return float(jnp.abs(jnp.where(experience.decides, ratio - 1, 0.0)).mean())

    assert moved(0.05) < 0.5 * moved(10.0)


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        ({"discount": 1.1}, "ppo.discount = 1.1: give a number from 0 to 1"),
        ({"trace": -0.1}, "ppo.trace = -0.1: give a number from 0 to 1"),
        ({"epochs": 0}, "ppo.epochs = 0: give at least 1"),
        ({"minibatches": 0}, "ppo.minibatches = 0: give at least 1"),
        ({"learning_rate": 0.0}, "ppo.learning_rate = 0.0: give a positive number"),
        ({"longest_gradient": float("nan")}, "ppo.longest_gradient = nan: give a positive number"),
        ({"entropy": -1.0}, "ppo.entropy = -1.0: give a number of at least 0"),
        ({"clip": 0.0}, "ppo.clip = 0.0: give a positive number"),
        ({"value_clip": 0.0}, "ppo.value_clip = 0.0: give a positive number, or None for no bound"),
    ],
)
def test_refuses_what_cannot_be_meant(fields: dict, expected: str) -> None:
    assert refusal(unhooked(ppo).PPOConfig, **fields) == expected
