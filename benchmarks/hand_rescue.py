"""Search and rescue by hand: skills that act by what an agent sees, and a team that is told the state."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from skillcrew.envs.rescue.state import RescueState
from skillcrew.envs.rescue.world import RescueDomain

BASE, VICTIM, CALL, AGENT, UNSEARCHED = 0, 3, 8, 10, 12
"""Where in an observation each offset begins."""
TOWARDS = {
    "go_to_victim": (VICTIM, 1),
    "go_to_call": (CALL, 1),
    "go_to_base": (BASE, 1),
    "search": (UNSEARCHED, 1),
    "go_to_agent": (AGENT, 1),
    "go_away_from_agent": (AGENT, -1),
}
FAR = 1e6


def actions(
    env: RescueDomain, observation: Float[Array, "agents obs worlds"]
) -> Float[Array, "skills agents 2 worlds"]:
    """Straight to where each skill's target is, or from it; stays where there is none."""
    speed = env.config.max_speed
    return jnp.stack(
        [
            towards(sign * observation[:, at : at + 2], speed)
            for at, sign in (TOWARDS[name] for name in env.skills)
        ]
    )


def towards(offset: Float[Array, "agents 2 worlds"], speed: float) -> Float[Array, "agents 2 worlds"]:
    """The action that goes to a place, and no farther."""
    distance = jnp.sqrt((offset**2).sum(1, keepdims=True))
    return offset / jnp.maximum(distance, speed)


def told(env: RescueDomain, state: RescueState) -> Int[Array, "agents worlds"]:
    """Bearers to the base; as many as it takes to each victim that anybody senses; the rest search."""
    return jax.vmap(lambda one: _told(env, one), in_axes=-1, out_axes=-1)(state)


def _told(env: RescueDomain, state: RescueState) -> Int[Array, " agents"]:
    config, skill = env.config, env.skills.index
    offsets = state.victim[:, None] - state.position[None]
    distance = jnp.sqrt((offsets**2).sum(2))
    lying = ~state.saved & ~state.held.any(1)
    sensed = (distance <= config.sensor_radius) & lying[:, None]
    target = assigned(distance, sensed.any(1), ~state.held.any(0), config.coupling)
    own = jnp.where(sensed, distance, FAR).argmin(0)
    to_it = jnp.where(sensed.any(0) & (own == target), skill("go_to_victim"), skill("go_to_call"))
    choice = jnp.where(target >= 0, to_it, skill("search"))
    # Too few to lift it: whoever senses a victim stays, so that it is not lost again.
    too_few = (target < 0) & sensed.any(0) & ((target[None] == own[:, None]).sum(1) < config.coupling)
    choice = jnp.where(too_few, skill("go_to_victim"), choice)
    return jnp.where(state.held.any(0), skill("go_to_base"), choice).astype(jnp.int32)


def assigned(
    distance: Float[Array, "loads agents"],
    wanted: Bool[Array, " loads"],
    free: Bool[Array, " agents"],
    coupling: int,
) -> Int[Array, " agents"]:
    """To which load each agent is sent, or -1: the nearest to the one that they are nearest to, and so on."""
    n_loads, n_agents = distance.shape
    target = jnp.full(n_agents, -1)
    for _ in range(n_loads):
        left = jnp.where((free & (target < 0))[None], distance, FAR)
        cost = jnp.where(wanted, jnp.sort(left, axis=1)[:, :coupling].sum(1), FAR)
        load = cost.argmin()
        enough = cost[load] < FAR
        rank = left[load].argsort().argsort()
        target = jnp.where(enough & (rank < coupling), load, target)
        wanted = wanted & (jnp.arange(n_loads) != load)
    return target
