"""Rounds of updates of several learners side by side, each on batches of its own."""

from collections.abc import Callable

import jax
from jaxtyping import Array, Float, Key

from skillcrew.learners.batch import Batch
from skillcrew.learners.dqn import DQNConfig
from skillcrew.learners.learner import Learner, LearnerState
from skillcrew.learners.td3 import TD3Config


def train_learners(
    key: Key[Array, ""],
    learner: Learner,
    learners: LearnerState,
    draw: Callable[[Key[Array, ""]], Batch],
    updates: int,
) -> tuple[LearnerState, dict[str, Float[Array, " learners"]]]:
    """Updates all learners.

    Args:
        learners: with a leading learner axis.
        draw: mini-batches with leading axes [learners, policy_delay, batch_size].
        updates: critic updates per learner; a multiple of the learner's policy delay.

    Returns:
        The learners, and their mean losses.
    """
    n_learners = jax.tree.leaves(learners)[0].shape[0]

    def one_round(learners, key):
        key_sample, key_update = jax.random.split(key)
        return jax.vmap(learner.update)(learners, draw(key_sample), jax.random.split(key_update, n_learners))

    keys = jax.random.split(key, updates // learner.config.policy_delay)
    trained, losses = jax.lax.scan(one_round, learners, keys)
    return trained, jax.tree.map(lambda loss: loss.mean(0), losses)


def round_bytes(config: TD3Config | DQNConfig, learners: int, width: int) -> int:
    """Estimate of the memory of one round: mini-batches, and what the networks make of them.

    Args:
        width: numbers per transition.
    """
    # Eight: measured, of an actor and two critics, there and back.
    numbers = 2 * config.policy_delay * width + 8 * sum(config.network.hidden)
    return 4 * learners * config.batch_size * numbers
