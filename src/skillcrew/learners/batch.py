"""What learners learn from."""

import equinox as eqx
from jaxtyping import Array, Float, Int


class Batch(eqx.Module):
    """Transitions with the one reward that a learner maximises.

    Those of whole teams, for critics that see all agents, have the agents as the last axis of their batch.
    """

    observation: Float[Array, "*batch obs"]
    action: Float[Array, "*batch act"]
    """Where actions are discrete, a 1 at the place of the one that was taken and 0 elsewhere."""
    reward: Float[Array, "*batch"]
    next_observation: Float[Array, "*batch obs"]
    terminated: Float[Array, "*batch"]
    discount: Float[Array, "*batch"] | None = None
    """Where learners side by side differ in it; None for the configuration's."""
    acted: Int[Array, "*batch"] | None = None
    """Which of its policies an agent acted by, where agents have several."""
