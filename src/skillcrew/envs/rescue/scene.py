"""What there is to draw of search and rescue."""

import jax.numpy as jnp

from skillcrew.envs.rescue.config import RescueConfig
from skillcrew.envs.rescue.search import centre_of
from skillcrew.envs.rescue.state import RescueState
from skillcrew.envs.scene import Discs, Lines, Points, Scene


def scene(config: RescueConfig, state: RescueState) -> Scene:
    """One moment of one world."""
    agents, cells = config.n_agents, config.cells**2
    lifted = state.held.any(1)
    victims = jnp.where(state.saved, 2, jnp.where(lifted, 1, 0))
    pairs = (config.n_victims * agents, 2)
    return Scene(
        low=(0.0, 0.0),
        high=(config.world_size, config.world_size),
        points=(
            Points("agents", state.position),
            Points("victims", state.victim, state=victims, states=("lying", "carried", "saved")),
        ),
        discs=(
            Discs("base", state.base[None], jnp.array([config.base_radius])),
            Discs("sensors", state.position, jnp.full(agents, config.sensor_radius)),
            Discs(
                "searched",
                jnp.stack(centre_of(config, jnp.arange(cells)), axis=1),
                jnp.full(cells, config.cell_size / 2),
                state=jnp.where(state.searched, 0, -1),
                states=("searched",),
            ),
        ),
        lines=(
            Lines(
                "holds",
                jnp.broadcast_to(state.position[None], (config.n_victims, agents, 2)).reshape(pairs),
                jnp.broadcast_to(state.victim[:, None], (config.n_victims, agents, 2)).reshape(pairs),
                state=jnp.where(state.held, 0, -1).ravel(),
                states=("holds",),
            ),
        ),
    )
