"""Training of K skills from one buffer (lines 16 to 22 of Algorithm 1)."""

import dataclasses

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Key, PyTree

from skillcrew.conditional import run_unless
from skillcrew.learners.td3 import TD3, Batch, TD3State
from skillcrew.learners.training import train_learners
from skillcrew.replay import ReplayBuffer


def train_skills(
    key: Key[Array, ""],
    learner: TD3,
    learners: TD3State,
    stopped: Bool[Array, " skills"],
    buffer: ReplayBuffer,
    experience: PyTree,
    updates: int,
    task_ends_skills: bool,
) -> tuple[TD3State, dict[str, Float[Array, " skills"]]]:
    """Updates each skill's learner on its own reward, except those that have stopped.

    Args:
        learners: with a leading skill axis.
        updates: critic updates per skill; a multiple of the learner's policy delay.
        task_ends_skills: whether a skill's value ends where the team's task is done.

    Returns:
        The learners, and their mean losses (NaN where a skill has stopped).
    """
    n_skills = stopped.shape[0]
    config = learner.config

    def draw(key: Key[Array, ""]) -> Batch:
        batches = _sample(key, buffer, experience, n_skills, config.policy_delay, config.batch_size)
        if task_ends_skills:
            return batches
        return dataclasses.replace(batches, terminated=jnp.zeros_like(batches.terminated))

    def train(learners):
        trained, losses = train_learners(key, learner, learners, draw, updates)
        kept = jax.tree.map(lambda new, old: _where(stopped, old, new), trained, learners)
        return kept, jax.tree.map(lambda loss: jnp.where(stopped, jnp.nan, loss), losses)

    nothing = {name: jnp.full(n_skills, jnp.nan) for name in ("critic_loss", "actor_loss")}
    return run_unless(stopped.all(), lambda carry: train(carry[0]), (learners, nothing))


def _sample(
    key: Key[Array, ""], buffer: ReplayBuffer, experience: PyTree, n_skills: int, delay: int, batch_size: int
) -> Batch:
    """Each skill's own mini-batches [skills, delay, batch_size, …], with the skill's own reward."""
    drawn = buffer.sample(experience, key, n_skills * delay * batch_size)
    drawn = jax.tree.map(lambda leaf: leaf.reshape(n_skills, delay, batch_size, *leaf.shape[1:]), drawn)
    reward = jax.vmap(lambda rewards, skill: rewards[..., skill])(drawn.local_rewards, jnp.arange(n_skills))
    return Batch(drawn.observation, drawn.action, reward, drawn.next_observation, drawn.terminated)


def _where(mask: Bool[Array, " skills"], first: Array, second: Array) -> Array:
    return jnp.where(mask.reshape(-1, *(1,) * (first.ndim - 1)), first, second)
