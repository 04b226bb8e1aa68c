"""Several policies for each agent, of which one acts for an episode (MADDPG; Lowe et al. 2017, 4.3)."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, Key, PyTree

from skillcrew.policies.actor import Actor
from skillcrew.policies.memory import for_each_agent
from skillcrew.policies.team import Action


class EnsembleTeam(eqx.Module):
    """Agents act by one of their policies each, which is their choice; discrete actions are drawn by it."""

    actors: Actor
    """Leaves have leading axes: one for each agent, or a single one that all share; and the policies."""
    acting: Int[Array, " agents"]
    """Which of its policies each agent acts by."""
    choices: int = eqx.field(static=True, default=0)
    """Discrete actions that each decision is made among; 0 for continuous actions."""

    def initial_memory(self) -> PyTree:
        return ()

    def act(
        self, observation: Float[Array, "agents obs"], memory: PyTree, key: Key[Array, ""]
    ) -> tuple[Action, PyTree, Int[Array, " agents"]]:
        outputs = outputs_of(self.actors, observation[:, None], self.acting[:, None])[:, 0]
        drawn = jax.random.categorical(key, outputs).astype(jnp.int32) if self.choices else None
        return jnp.tanh(outputs) if drawn is None else drawn, memory, self.acting


def outputs_of(
    actors: Actor, observation: Float[Array, "agents batch obs"], acting: Int[Array, "agents batch"]
) -> Float[Array, "agents batch act"]:
    """What the policy that acts says, before tanh; of discrete actions the logits.

    All of an agent's policies are asked, for products of large matrices are cheap and picking weights is not.
    """

    def of_agent(policies: Actor, seen: Array, acting: Array) -> Array:
        every = jax.vmap(lambda policy: jax.vmap(policy.before_squashing)(seen))(policies)
        if len(every) == 1:
            return every[0]
        return (jax.nn.one_hot(acting, len(every), axis=0)[:, :, None] * every).sum(0)

    return for_each_agent(of_agent, actors, observation, acting)
