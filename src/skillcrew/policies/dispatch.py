"""Each agent's action by the skill that it chose, for a few agents or for whole batches of worlds.

In a generation of the Rover Domain this is most of the arithmetic of a rollout. Evaluating every skill
for every agent and keeping one of the results wastes all but one; giving each agent a copy of its
skill's weights makes matrix-vector products of matrix products. So agents are sorted by skill into
blocks, and each block is one matrix product with one skill: with 8 skills and the 1280 agents of a
batch it takes an eighth of the time, with five seeds side by side a sixth.
"""

import jax
import jax.numpy as jnp
from jax.custom_batching import custom_vmap
from jaxtyping import Array, Bool, Float, Int, PyTree

from skillcrew.policies.action_values import ActionValues
from skillcrew.policies.actor import Actor

Skills = Actor | ActionValues
"""Leaves have a leading skill axis. `ActionValues` where actions are discrete."""

BLOCK = 64
"""Agents per matrix product: half-empty blocks are wasted, small ones slow. 32 to 128 differ little."""


@custom_vmap
def apply_skills(
    skills: Skills, observation: Float[Array, "agents obs"], choice: Int[Array, " agents"]
) -> Float[Array, "agents act"]:
    """Each agent's action by its chosen skill.

    Under `vmap` over worlds or teams, all their agents are dealt out together.

    Args:
        skills: leaves have a leading skill axis.
        choice: index of a skill.
    """
    if len(observation) <= BLOCK // 2:
        return _all_skills(skills, observation, choice)
    return _by_blocks(skills, observation, choice)


@apply_skills.def_vmap
def _batched(
    axis_size: int, in_batched: list[PyTree], skills: Skills, observation: Array, choice: Array
) -> tuple[Array, bool]:
    """More agents, if they share their skills; else, as for seeds, one dealing out beside the other."""
    axes = jax.tree.map(lambda batched: 0 if batched else None, tuple(in_batched))
    if any(jax.tree.leaves(in_batched[0])):
        agents = observation.shape[1 if in_batched[1] else 0]
        one = _all_skills if agents <= BLOCK // 2 else _by_blocks
        return jax.vmap(one, in_axes=axes, axis_size=axis_size)(skills, observation, choice), True
    observation, choice = (
        each if batched else jnp.broadcast_to(each, (axis_size, *each.shape))
        for each, batched in zip((observation, choice), in_batched[1:], strict=True)
    )
    agents = choice.shape[1]
    merged = apply_skills(
        skills, observation.reshape(axis_size * agents, -1), choice.reshape(axis_size * agents)
    )
    return merged.reshape(axis_size, agents, -1), True


def _all_skills(skills: Skills, observation: Array, choice: Array) -> Float[Array, "agents act"]:
    """Every skill for every agent, and the chosen one kept: for few agents there is nothing to sort."""
    actions = jax.vmap(lambda skill: jax.vmap(skill)(observation))(skills)
    chosen = jax.nn.one_hot(choice, actions.shape[0], axis=0, dtype=actions.dtype)
    return (chosen[:, :, None] * actions).sum(0)


def _by_blocks(skills: Skills, observation: Array, choice: Array) -> Float[Array, "agents act"]:
    """Blocks of agents that chose the same skill, one matrix product each."""
    n_skills, agents = jax.tree.leaves(skills)[0].shape[0], len(choice)
    n_blocks = agents // BLOCK + n_skills
    place, owner = _places(choice[None, :] == jnp.arange(n_skills)[:, None], n_blocks)
    # A place that nobody takes holds the first agent, for nothing.
    taken_by = jnp.zeros(n_blocks * BLOCK, jnp.int32).at[place].set(jnp.arange(agents, dtype=jnp.int32))
    blocks = observation[taken_by].reshape(n_blocks, BLOCK, -1)
    of_block = jax.tree.map(lambda leaf: leaf[owner], skills)
    actions = jax.vmap(lambda skill, block: jax.vmap(skill)(block))(of_block, blocks)
    return actions.reshape(n_blocks * BLOCK, -1)[place]


def _places(
    chosen: Bool[Array, "skills agents"], n_blocks: int
) -> tuple[Int[Array, " agents"], Int[Array, " blocks"]]:
    """Each agent's place in the row of blocks, and whose skill's each block is.

    A skill's blocks are as many as its agents fill; the last of them may stay half empty.
    """
    nth = _count_along(chosen)
    filled = jnp.ceil(nth[:, -1] / BLOCK)
    ends = _running_sum(filled[:, None], axis=0)[:, 0]
    place = jnp.where(chosen, (ends - filled)[:, None] * BLOCK + nth - 1, 0.0).sum(0).astype(jnp.int32)
    owner = (jnp.arange(n_blocks, dtype=jnp.float32)[:, None] >= ends[None, :]).sum(1, dtype=jnp.int32)
    # Blocks beyond the last are nobody's.
    return place, jnp.minimum(owner, len(ends) - 1)


def _count_along(chosen: Bool[Array, "skills agents"]) -> Float[Array, "skills agents"]:
    """How many of the agents up to each one chose a skill.

    Sums of rows of rows, as matrix products: XLA compiles a long cumulative sum, and runs it, slowly.
    """
    skills, agents = chosen.shape
    padded = jnp.pad(chosen.astype(jnp.float32), ((0, 0), (0, -agents % BLOCK)))
    within = _running_sum(padded.reshape(skills, -1, BLOCK), axis=2)
    of_rows = within[:, :, -1]
    before = _running_sum(of_rows, axis=1) - of_rows
    return (within + before[:, :, None]).reshape(skills, -1)[:, :agents]


def _running_sum(x: Float[Array, "..."], axis: int) -> Float[Array, "..."]:
    size = x.shape[axis]
    return jnp.moveaxis(jnp.moveaxis(x, axis, -1) @ jnp.triu(jnp.ones((size, size))), -1, axis)
