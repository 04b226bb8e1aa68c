"""What an agent senses, and what it hears from the others."""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from skillcrew.envs.plane import Nearest, Offset, either, nearest, offset, others
from skillcrew.envs.rescue.config import RescueConfig
from skillcrew.envs.rescue.search import to_cell
from skillcrew.envs.rescue.state import RescueState

HELD = -1.0
"""Ranks the victim that an agent holds before all others."""


class Sensed(NamedTuple):
    """Everything that an agent knows of, as seen by each agent."""

    base: Offset
    victim: Nearest
    """The one that it holds, or the nearest in its sensor's radius that nobody holds."""
    helpers: Float[Array, "agents *worlds"]
    """Agents within reach of that victim, as a share of what it takes, at most 1."""
    holding: Bool[Array, "agents *worlds"]
    call: Nearest
    """The nearest victim that nobody holds and that another agent senses."""
    agent: Nearest
    """The nearest other."""
    unsearched: Offset
    """The cell to search next."""


def sense(config: RescueConfig, state: RescueState) -> Sensed:
    """What each agent senses and hears in a state."""
    offsets = [offset(state.position, victim) for victim in state.victim]
    lying = ~state.saved & ~either(state.held[:, agent] for agent in range(config.n_agents))
    sensed = [
        (one.squared <= config.sensor_radius**2) & lies[None]
        for one, lies in zip(offsets, lying, strict=True)
    ]
    holding = either(state.held)
    victim = nearest(
        (one, near | held, jnp.where(held, HELD, one.squared))
        for one, near, held in zip(offsets, sensed, state.held, strict=True)
    )
    return Sensed(
        base=offset(state.position, state.base),
        victim=victim,
        helpers=_helpers(config, offsets, victim, holding),
        holding=holding,
        call=nearest((one, _by_others(near), None) for one, near in zip(offsets, sensed, strict=True)),
        agent=others(state.position),
        unsearched=to_cell(config, state.position, state.next_cell),
    )


def observation(sensed: Sensed) -> Float[Array, "agents obs *worlds"]:
    """The numbers that an agent sees; flags are 0 or 1, offsets in metres along the square's axes."""
    like = sensed.base.dx
    readings = [
        *sensed.base,
        sensed.victim.there,
        *sensed.victim.offset,
        sensed.helpers,
        sensed.holding,
        sensed.call.there,
        *sensed.call.offset,
        *sensed.agent.offset,
        *sensed.unsearched,
    ]
    return jnp.stack([reading.astype(like.dtype) for reading in readings], axis=1)


OBSERVATION_SIZE = 14


def _by_others(near: Bool[Array, "agents *worlds"]) -> Bool[Array, "agents *worlds"]:
    """Whom a victim is reported to: everybody if two sense it, and all but the one if only one does."""
    count = near.sum(0, dtype=jnp.int32)[None]
    return count - near.astype(jnp.int32) > 0


def _helpers(
    config: RescueConfig,
    offsets: list[Offset],
    victim: Nearest,
    holding: Bool[Array, "agents *worlds"],
) -> Float[Array, "agents *worlds"]:
    """How many are within reach of each agent's own victim; those who hold it are enough."""
    of_mine = jnp.zeros_like(victim.rank)
    for index, one in enumerate(offsets):
        count = (one.squared <= config.reach**2).sum(0, dtype=jnp.int32).astype(of_mine.dtype)
        of_mine = jnp.where(victim.index == index, count[None], of_mine)
    return jnp.where(holding, 1.0, jnp.minimum(of_mine / config.coupling, 1.0))
