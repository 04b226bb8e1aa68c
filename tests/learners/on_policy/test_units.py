"""What a reward's unit is, and where its zero lies, is nothing that critics have to learn first.

And where nothing is paid, nobody comes to be sure of anything.
"""

import dataclasses
import math
import sys
from typing import Any

import jax
import jax.numpy as jnp
import pytest

from oracles import on_policy as oracle
from skillcrew.learners.coma import COMA, COMALearnerConfig
from skillcrew.learners.liir import LIIR, LIIRLearnerConfig
from skillcrew.learners.ppo import PPO, PPOConfig
from skillcrew.policies.memory import PolicyConfig

NETWORK = PolicyConfig(hidden=(8,), input_scaling="none", sharing="team")
GENERATIONS = 20
FAST: dict[str, Any] = {"minibatches": 2, "learning_rate": 5e-3}


def critic_loss(kind: Any, config: Any, *view: Any) -> float:
    """After some generations in which every step pays thousands."""
    learning = kind(config, oracle.CHOOSERS, NETWORK, NETWORK, *view)
    experience = oracle.lived(0)
    counted = experience.mask[..., None]
    thousands = jnp.where(counted, 1000 * experience.reward - 5000, 0.0)
    paid = dataclasses.replace(experience, reward=thousands)
    state, update = jax.jit(learning.init)(jax.random.key(0)), jax.jit(learning.update)
    for key in jax.random.split(jax.random.key(1), GENERATIONS):
        state, metrics = update(state, paid, key)
    return float(metrics["critic_loss"])


@pytest.mark.parametrize(
    ("kind", "config", "view"),
    [
        (PPO, PPOConfig, ("joint",)),
        (COMA, COMALearnerConfig, ()),
        (LIIR, LIIRLearnerConfig, ()),
    ],
)
def test_critics_learn_returns_on_their_own_scale(kind: Any, config: Any, view: tuple[str, ...]) -> None:
    """Most of what returns differ by is known after a few generations; in units of the reward, nothing is."""
    assert critic_loss(kind, config(**FAST), *view) < 0.5
    assert critic_loss(kind, config(**FAST, normalise_values=False), *view) > 1e5


def entropy_after(kind: Any, config: Any, *view: Any) -> float:
    """Of policies that saw nothing but episodes without a reward."""
    learning = kind(config, oracle.CHOOSERS, NETWORK, NETWORK, *view)
    silent = dataclasses.replace(oracle.lived(0), reward=jnp.zeros_like(oracle.lived(0).reward))
    state, update = jax.jit(learning.init)(jax.random.key(0)), jax.jit(learning.update)
    for key in jax.random.split(jax.random.key(1), GENERATIONS):
        state, metrics = update(state, silent, key)
    return float(metrics["entropy"])


@pytest.mark.parametrize(
    ("kind", "config", "view"),
    [
        (PPO, PPOConfig(**FAST), ("joint",)),
        (COMA, COMALearnerConfig(**FAST, first_floor=0.0, last_floor=0.0), ()),
    ],
)
def test_critics_errors_alone_make_no_policy_sure(
    kind: Any, config: Any, view: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    even = math.log(oracle.CHOICES)
    assert entropy_after(kind, config, *view) > 0.98 * even
    # With their deviation brought to 1, as is usual, they do.
    monkeypatch.setattr(sys.modules[kind.__module__], "paid_apart", lambda *_: jnp.array(jnp.inf))
    assert entropy_after(kind, config, *view) < 0.95 * even
