"""The rewards of the skills and of the team."""

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int


def closeness(squared_distance: Float[Array, "*any"], activation_distance: float) -> Float[Array, "*any"]:
    """min(1, activation distance / distance), in (0, 1]: the local reward of "go to"."""
    # The bound under the root gives both the minimum with 1 and a finite value at distance 0.
    return activation_distance / jnp.sqrt(jnp.maximum(squared_distance, activation_distance**2))


def team_reward(
    before: Bool[Array, "types *worlds"], after: Bool[Array, "types *worlds"], kind: str
) -> Array:
    """The team's reward of one step, `kind` "binary" or "fraction"; over an episode in [0, 1]."""
    if kind == "fraction":
        gained: Int[Array, "*worlds"] = (after & ~before).sum(0)
        return gained.astype(jnp.float32) / len(after)
    return (after.all(0) & ~before.all(0)).astype(jnp.float32)


def skill_names(type_names: tuple[str, ...], n_agents: int) -> tuple[str, ...]:
    """`go_to_X` and `go_away_from_X` for each POI type and, in a team, for the closest agent.

    The order is that of the local rewards (thesis, section 4.4.2).
    """
    targets = [f"poi_{name}" for name in type_names] + ["agent"] * (n_agents > 1)
    return tuple(f"{verb}_{target}" for target in targets for verb in ("go_to", "go_away_from"))
