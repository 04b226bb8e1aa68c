"""Where everything is in a Rover Domain, and how it is drawn."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, Key

from skillcrew.envs.rover.config import RoverConfig

START_SHARE = 0.3
"""Rovers start in this central share of each axis."""
NEVER = 2**31 - 1
"""The step at which a rover breaks down that does not."""


class Progress(eqx.Module):
    """What the team has to show for itself: all of a state that depends on who is in the team."""

    observed: Bool[Array, "pois *worlds"]
    closest: Float[Array, "pois *worlds"] | None
    """See `RoverState`."""


class RoverState(eqx.Module):
    """Where everything is. A batch of worlds has its axis last in every field.

    What only an option needs is None without it.
    """

    position: Float[Array, "agents 2 *worlds"]
    """Metres; the square spans 0 to `world_size` on both axes."""
    heading: Float[Array, "agents *worlds"]
    """Radians in [-π, π), counter-clockwise from the x axis."""
    poi_position: Float[Array, "pois 2 *worlds"]
    """Metres; ordered by type."""
    observed: Bool[Array, "pois *worlds"]
    time: Int[Array, "*worlds"]
    """Steps since the reset."""
    poi_direction: Float[Array, "pois 2 *worlds"] | None = None
    """Cosine and sine of the course that each POI is on (`poi_speed`)."""
    order: Int[Array, "types *worlds"] | None = None
    """Each type's place in the order in which they must be observed, from 0 (`order = "drawn"`)."""
    breaks_at: Int[Array, "agents *worlds"] | None = None
    """The first step that a rover does not take part in, or `NEVER` (`breakdowns`)."""
    closest: Float[Array, "pois *worlds"] | None = None
    """`min_distance` over the distance of the best visit so far, at most 1; 0 where there was none
    (`team_reward = "closest"`)."""

    def working(self) -> Bool[Array, "agents *worlds"] | None:
        """Which rovers take part in the step that comes now; None if all always do."""
        return None if self.breaks_at is None else self.time[None] < self.breaks_at

    def progress(self) -> Progress:
        """Rovers do not get in each other's way: nothing else depends on them."""
        return Progress(self.observed, self.closest)

    def with_progress(self, progress: Progress) -> "RoverState":
        """The same places at the same time, with what another team has to show."""
        return dataclasses.replace(self, observed=progress.observed, closest=progress.closest)


def draw_state(config: RoverConfig, key: Key[Array, ""]) -> RoverState:
    """A world at the start of an episode. Options that are off draw nothing."""
    agents, types, pois = config.n_agents, config.n_poi_types, config.n_pois
    sizes = {"start": 2 * agents, "turn": agents, "poi": 2 * pois}
    sizes |= {"course": pois} if config.poi_speed else {}
    sizes |= {"order": types} if config.order == "drawn" else {}
    sizes |= {"who breaks": agents, "when": agents} if config.breakdowns else {}
    # One draw for everything: each random operation of its own takes XLA long to compile.
    draw, parts = jax.random.uniform(key, (sum(sizes.values()),)), {}
    for name, size in sizes.items():
        parts[name], draw = draw[:size], draw[size:]
    margin = (1 - START_SHARE) / 2
    return RoverState(
        position=config.world_size * (margin + START_SHARE * parts["start"].reshape(agents, 2)),
        heading=jnp.pi * (2 * parts["turn"] - 1),
        poi_position=config.world_size * parts["poi"].reshape(pois, 2),
        observed=jnp.zeros(pois, bool),
        time=jnp.zeros((), jnp.int32),
        poi_direction=_direction(parts["course"]) if "course" in parts else None,
        order=_permutation(parts["order"]) if "order" in parts else None,
        breaks_at=_breakdowns(config, parts["who breaks"], parts["when"]) if "when" in parts else None,
        closest=jnp.zeros(pois) if config.team_reward == "closest" else None,
    )


def _direction(draw: Float[Array, " pois"]) -> Float[Array, "pois 2"]:
    return jnp.stack([jnp.cos(2 * jnp.pi * draw), jnp.sin(2 * jnp.pi * draw)], axis=1)


def _permutation(draw: Float[Array, " n"]) -> Int[Array, " n"]:
    """0 to n - 1 in an order that is equally likely to be any, of numbers drawn uniformly."""
    return jnp.argsort(draw).astype(jnp.int32)


def _breakdowns(
    config: RoverConfig, who: Float[Array, " agents"], when: Float[Array, " agents"]
) -> Int[Array, " agents"]:
    step = jnp.floor(when * config.episode_length).astype(jnp.int32)
    return jnp.where(_permutation(who) < config.breakdowns, step, NEVER)
