"""The wall and its corridor: how agents move in the building, and how far it is from place to place."""

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from skillcrew.envs.plane import driven, either
from skillcrew.envs.warehouse.config import WarehouseConfig
from skillcrew.envs.warehouse.state import WarehouseState


def moved(
    config: WarehouseConfig, state: WarehouseState, action: Float[Array, "agents 2 *worlds"]
) -> Float[Array, "agents 2 *worlds"]:
    """Where agents are after driving: the wall stops them, and so does an occupied corridor."""
    speed = jnp.where(either(state.held), config.carry_speed, config.max_speed)
    goal = state.position + driven(action, speed)
    goal_x = jnp.clip(goal[:, 0], -config.length / 2, config.length / 2)
    goal_y = jnp.clip(goal[:, 1], -config.width / 2, config.width / 2)
    half, gap = config.corridor_length / 2, state.gap[None]
    low, high = gap - config.corridor_width / 2, gap + config.corridor_width / 2
    x, inside = state.position[:, 0], in_corridor(config, state.position)
    to_strip = jnp.abs(goal_x) < half
    enters = ~inside & to_strip & (low <= goal_y) & (goal_y <= high)
    passes = inside | ~to_strip | _admitted(state, enters, inside)
    side = jnp.where(x < 0, -half, half)
    return jnp.stack(
        [
            jnp.where(passes, goal_x, side),
            jnp.where(inside, jnp.clip(goal_y, low, high), goal_y),
        ],
        axis=1,
    )


def in_corridor(
    config: WarehouseConfig, position: Float[Array, "agents 2 *worlds"]
) -> Bool[Array, "agents *worlds"]:
    """Who is within the wall, where there is only the corridor to be in."""
    return jnp.abs(position[:, 0]) < config.corridor_length / 2


def barred(state: WarehouseState, inside: Bool[Array, "agents *worlds"]) -> Bool[Array, "agents *worlds"]:
    """For whom the corridor is occupied: by any other agent, but for those who hold the same load."""
    return jnp.stack(
        [
            either([inside[other] & ~fellow for other, fellow in enumerate(fellows)])
            for fellows in _fellows(state)
        ]
    )


def _admitted(
    state: WarehouseState, enters: Bool[Array, "agents *worlds"], inside: Bool[Array, "agents *worlds"]
) -> Bool[Array, "agents *worlds"]:
    """Who of those that want to may enter: the first of them, in the agents' order, and its fellows."""
    wants, admitted = enters & ~barred(state, inside), []
    for agent, fellows in enumerate(_fellows(state)):
        may = wants[agent]
        for before, went in enumerate(admitted):
            may = may & (~went | fellows[before])
        admitted.append(may)
    return jnp.stack(admitted)


def _fellows(state: WarehouseState) -> list[list[Bool[Array, "*worlds"]]]:
    """For each agent and other: whether they hold the same load, or are the same."""
    agents = range(state.held.shape[1])
    always = jnp.ones_like(state.held[0, 0])
    return [
        [always if one == other else either(state.held[:, one] & state.held[:, other]) for other in agents]
        for one in agents
    ]


def path_length(
    config: WarehouseConfig,
    state: WarehouseState,
    place: Float[Array, "2 *worlds"],
    side: int,
) -> Float[Array, "agents *worlds"]:
    """How far it is from each agent to a place at one end, by the mouths of the corridor where it is to pass.

    Args:
        side: -1 for a place in the store, 1 for one at the counter.
    """
    half, x = config.corridor_length / 2, state.position[:, 0]

    def between(x1, y1, x2, y2):
        return jnp.sqrt((x1 - x2) ** 2 + (y1 - y2) ** 2)

    y, gap = state.position[:, 1], state.gap[None]
    place_x, place_y = place[None, 0], place[None, 1]
    behind = between(side * half, gap, place_x, place_y)
    from_corridor = between(x, y, side * half, gap) + behind
    from_beyond = between(x, y, -side * half, gap) + config.corridor_length + behind
    beyond = side * x <= -half
    return jnp.where(
        side * x >= half,
        between(x, y, place_x, place_y),
        jnp.where(beyond, from_beyond, from_corridor),
    )
