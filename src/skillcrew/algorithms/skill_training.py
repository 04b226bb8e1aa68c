"""Training of K skills from one buffer (lines 16 to 22 of Algorithm 1)."""

import dataclasses

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Key, PyTree

from skillcrew.conditional import run_unless
from skillcrew.learners.batch import Batch
from skillcrew.learners.learner import Learner, LearnerState
from skillcrew.learners.training import train_learners
from skillcrew.replay import ReplayBuffer


@dataclasses.dataclass(frozen=True)
class Members:
    """Where agents differ, whose transitions each skill learns from."""

    n_agents: int
    """Of all types."""
    of_skills: tuple[tuple[int, int], ...]
    """For each skill the first agent of its type, and how many agents that type has."""


def train_skills(
    key: Key[Array, ""],
    learner: Learner,
    learners: LearnerState,
    stopped: Bool[Array, " skills"],
    buffer: ReplayBuffer,
    experience: PyTree,
    updates: int,
    task_ends_skills: bool,
    members: Members | None = None,
) -> tuple[LearnerState, dict[str, Float[Array, " skills"]]]:
    """Updates each skill's learner on its own reward, except those that have stopped.

    Args:
        learners: with a leading skill axis.
        updates: critic updates per skill; a multiple of the learner's policy delay.
        task_ends_skills: whether a skill's value ends where the team's task is done.
        members: whose transitions each skill learns from; None for everybody's.

    Returns:
        The learners, and their mean losses (NaN where a skill has stopped).
    """
    n_skills = stopped.shape[0]
    config = learner.config

    def draw(key: Key[Array, ""]) -> Batch:
        shape = (n_skills, config.policy_delay, config.batch_size)
        batches = _sample(key, buffer, experience, shape, members)
        if task_ends_skills:
            return batches
        return dataclasses.replace(batches, terminated=jnp.zeros_like(batches.terminated))

    def train(learners):
        trained, losses = train_learners(key, learner, learners, draw, updates)
        kept = jax.tree.map(lambda new, old: _where(stopped, old, new), trained, learners)
        return kept, jax.tree.map(lambda loss: jnp.where(stopped, jnp.nan, loss), losses)

    nothing = {name: jnp.full(n_skills, jnp.nan) for name in learner.losses}
    return run_unless(stopped.all(), lambda carry: train(carry[0]), (learners, nothing))


def _sample(
    key: Key[Array, ""],
    buffer: ReplayBuffer,
    experience: PyTree,
    shape: tuple[int, int, int],
    members: Members | None,
) -> Batch:
    """Each skill's own mini-batches [skills, delay, batch_size, …], with the skill's own reward."""
    n_skills, delay, batch_size = shape
    if members is None:
        drawn = buffer.sample(experience, key, n_skills * delay * batch_size)
        drawn = jax.tree.map(lambda leaf: leaf.reshape(*shape, *leaf.shape[1:]), drawn)
    else:
        drawn = jax.vmap(
            lambda k, of: buffer.sample_of(experience, k, delay * batch_size, of, members.n_agents)
        )(jax.random.split(key, n_skills), jnp.asarray(members.of_skills))
        drawn = jax.tree.map(lambda leaf: leaf.reshape(*shape, *leaf.shape[2:]), drawn)
    reward = jax.vmap(lambda rewards, skill: rewards[..., skill])(drawn.local_rewards, jnp.arange(n_skills))
    return Batch(drawn.observation, drawn.action, reward, drawn.next_observation, drawn.terminated)


def _where(mask: Bool[Array, " skills"], first: Array, second: Array) -> Array:
    return jnp.where(mask.reshape(-1, *(1,) * (first.ndim - 1)), first, second)
