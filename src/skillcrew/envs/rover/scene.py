"""What there is to draw of a Rover Domain, and to say of its skills."""

import jax.numpy as jnp

from skillcrew.envs.rover.config import RoverConfig
from skillcrew.envs.rover.state import RoverState
from skillcrew.envs.scene import Discs, Labels, Points, Scene


def scene(config: RoverConfig, state: RoverState) -> Scene:
    """One moment of one world. Rovers may leave what is shown, unless they are `bounded`."""
    working = state.working()
    broken = jnp.zeros(config.n_agents, jnp.int32) if working is None else (~working).astype(jnp.int32)
    observed = state.observed.astype(jnp.int32)
    names = tuple(name for name in config.type_names for _ in range(config.pois_per_type))
    return Scene(
        low=(0.0, 0.0),
        high=(config.world_size, config.world_size),
        points=(
            Points("agents", state.position, state.heading, broken, ("working", "broken down")),
            Points("POIs", state.poi_position, None, observed, ("not observed", "observed"), names),
        ),
        discs=(
            Discs(
                "activation distance",
                state.poi_position,
                jnp.full(config.n_pois, config.activation_distance),
                observed,
                ("not observed", "observed"),
                names,
            ),
        ),
        labels=(Labels(state.poi_position, names),),
    )


def skill_texts(skills: tuple[str, ...]) -> dict[str, str]:
    """A sentence for each skill, whichever type of rover has it."""
    return {skill: _sentence(skill.partition("/")[2] or skill) for skill in skills}


def _sentence(skill: str) -> str:
    verb = "Goes away from" if skill.startswith("go_away_from_") else "Goes to"
    target = skill.removeprefix("go_away_from_").removeprefix("go_to_")
    what = "other rover" if target == "agent" else f"POI of type {target.removeprefix('poi_')}"
    return f"{verb} the nearest {what}."
