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
from jaxtyping import Array

from oracles import on_policy as oracle
from skillcrew.learners.coma import COMA, COMALearnerConfig
from skillcrew.learners.liir import LIIR, LIIRLearnerConfig
from skillcrew.learners.ppo import PPO, PPOConfig
from skillcrew.policies.memory import PolicyConfig

NETWORK = PolicyConfig(hidden=(8,), input_scaling="none", sharing="team")
GENERATIONS = 20
EPISODES = oracle.lived(0)
THOUSANDS = jnp.where(EPISODES.mask[..., None], 1000 * EPISODES.reward - 5000, 0.0)
NOTHING = jnp.zeros_like(EPISODES.reward)
FAST: dict[str, Any] = {"minibatches": 2, "learning_rate": 5e-3}


def learned(reward: Array, kind: Any, config: Any, *view: Any) -> dict[str, Array]:
    """What the last of some generations says, in all of which the same is paid."""
    learning = kind(config, oracle.CHOOSERS, NETWORK, NETWORK, *view)
    paid = dataclasses.replace(EPISODES, reward=reward)
    state, update = jax.jit(learning.init)(jax.random.key(0)), jax.jit(learning.update)
    metrics: dict[str, Array] = {}
    for key in jax.random.split(jax.random.key(1), GENERATIONS):
        state, metrics = update(state, paid, key)
    return metrics


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
    assert learned(THOUSANDS, kind, config(**FAST), *view)["critic_loss"] < 0.5
    as_paid = config(**FAST, normalise_values=False)
    assert learned(THOUSANDS, kind, as_paid, *view)["critic_loss"] > 1e5


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
    assert learned(NOTHING, kind, config, *view)["entropy"] > 0.98 * even
    # With their deviation brought to 1, as is usual, they do.
    monkeypatch.setattr(sys.modules[kind.__module__], "paid_apart", lambda *_: jnp.array(jnp.inf))
    assert learned(NOTHING, kind, config, *view)["entropy"] < 0.95 * even
