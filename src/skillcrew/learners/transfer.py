"""Learners that begin with the networks of others."""

import dataclasses

import jax
import jax.numpy as jnp

from skillcrew.learners.learner import LearnerState
from skillcrew.policies.rewiring import Inputs, rewired

NETWORKS = ("actor", "target_actor", "critics", "target_critics")
"""Fields of learners' states that are taken over, where they have them. Optimisers begin anew: Adam's
averages are of experience that is not taken over, and would be 0 for new inputs, uncorrected."""


def begin_with(
    fresh: LearnerState, other: LearnerState, places: dict[int, int], inputs: dict[int, Inputs], size: int
) -> LearnerState:
    """Learners of which some begin with the networks of others.

    Args:
        fresh, other: of the same kind and hidden layers; leaves have a leading axis of learners.
        places: for those that take over, which of the others' networks.
        inputs: for the same, where each number of their observation stands in the others'.
        size: of the others' observation.
    """
    networks = {name: getattr(fresh, name) for name in NETWORKS if hasattr(fresh, name)}
    for own, theirs in places.items():
        for name in networks:
            taken = jax.tree.map(lambda leaf, theirs=theirs: leaf[theirs], getattr(other, name))
            taken = rewired(taken, inputs[own], size)
            networks[name] = jax.tree.map(
                lambda all, one, own=own: all.at[own].set(one), networks[name], taken
            )
    # Copies, so that every leaf has memory of its own and may be donated.
    return dataclasses.replace(fresh, **jax.tree.map(jnp.copy, networks))
