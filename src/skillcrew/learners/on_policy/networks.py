"""Policies and critics of a team, as policy gradients train them."""

import dataclasses
from typing import Literal

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Key

from skillcrew.learners.on_policy.experience import Experience
from skillcrew.learners.on_policy.unroll import memories, unrolled
from skillcrew.policies.distributions import Distribution
from skillcrew.policies.memory import MemoryNetwork, PolicyConfig, dealt_out
from skillcrew.policies.network import MLP, scale_input
from skillcrew.policies.orthogonal import begun_orthogonally
from skillcrew.policies.stochastic import Options, StochasticPolicy

View = Literal["own", "joint"]
"""What a critic sees: its agent's observation alone, or those of all agents and whose value is asked."""


@dataclasses.dataclass(frozen=True)
class Players:
    """Who acts: how many, what each sees, and among what it decides."""

    n_agents: int
    observation_size: int
    options: Options
    types: tuple[int, ...] = ()
    """The index of each agent's type; empty where agents are alike."""

    def networks(self, config: PolicyConfig) -> int:
        """How many networks they have, of their own or shared."""
        return self.n_agents if config.sharing == "agent" else len(set(self.types)) or 1

    def seen_by_critics(
        self, observation: Float[Array, "time worlds agents obs"], view: View
    ) -> Float[Array, "time worlds agents seen"]:
        """What each agent's critic sees."""
        if view == "own":
            return observation
        shape = (*observation.shape[:3], -1)
        joint = observation.reshape(*observation.shape[:2], 1, -1)
        joint = jnp.broadcast_to(joint, (*shape[:3], joint.shape[-1]))
        whose = jnp.broadcast_to(jnp.eye(self.n_agents), (*shape[:3], self.n_agents))
        return jnp.concatenate([joint, whose], axis=-1)

    def seen_size(self, view: View) -> int:
        """Length of what a critic sees."""
        if view == "own":
            return self.observation_size
        return self.n_agents * (self.observation_size + 1)


class Policies:
    """A team's stochastic policies along whole episodes."""

    def __init__(self, players: Players, config: PolicyConfig):
        self._players = players
        self._config = config

    def create(self, key: Key[Array, ""]) -> StochasticPolicy:
        """Draws them; leaves have a leading axis of networks."""
        players = self._players
        keys = jax.random.split(key, players.networks(self._config))
        return jax.vmap(
            lambda k: StochasticPolicy.create(k, players.observation_size, players.options, self._config)
        )(keys)

    def distributions(
        self, policies: StochasticPolicy, observation: Float[Array, "time worlds agents obs"]
    ) -> Distribution:
        """What each agent draws from at every step."""
        dealt = dealt_out(policies, self._players.types, self._config)
        outputs = dealt.with_deviation(unrolled(dealt.network, observation))
        return self._players.options.distribution(outputs)

    def of_taken(
        self, policies: StochasticPolicy, experience: Experience
    ) -> tuple[Float[Array, "time worlds agents"], Float[Array, "time worlds agents"]]:
        """The log-probability of what was done at every step, and the entropy there, in nats."""
        distribution = self.distributions(policies, experience.observation[:-1])
        return distribution.log_probability(experience.taken), distribution.entropy()


class Critics:
    """A team's critics along whole episodes.

    Those that see all agents and have memory remember what all saw, whosever value is asked and whatever they
    see beside it: of that there is one memory, not one for each agent.

    Args:
        extra: numbers that they see beside the view.
        outputs: numbers that they give for each agent.
    """

    def __init__(self, players: Players, config: PolicyConfig, view: View, extra: int = 0, outputs: int = 1):
        self._players = players
        self._config = config
        self._view: View = view
        self._sizes = (players.seen_size(view) + extra, outputs)
        self._remembered = players.n_agents * players.observation_size if view == "joint" else None

    def create(self, key: Key[Array, ""]) -> MemoryNetwork:
        """Draws them; leaves have a leading axis of networks."""

        def one(key: Key[Array, ""]) -> MemoryNetwork:
            key_draw, key_weights = jax.random.split(key)
            network = MemoryNetwork.create(key_draw, *self._sizes, self._config, self._remembered)
            return begun_orthogonally(key_weights, network, last_gain=1.0)

        return jax.vmap(one)(jax.random.split(key, self._players.networks(self._config)))

    def __call__(
        self,
        critics: MemoryNetwork,
        observation: Float[Array, "time worlds agents obs"],
        extra: Float[Array, "time worlds agents extra"] | None = None,
    ) -> Float[Array, "time worlds agents outputs"]:
        """What they say at every step."""
        networks = dealt_out(critics, self._players.types, self._config)
        joint = observation.reshape(*observation.shape[:2], -1) if self._view == "joint" else None
        if joint is not None and len(networks.network.weights[0]) == 1:
            return self._of_one(jax.tree.map(lambda leaf: leaf[0], networks), joint, extra)
        seen = self._players.seen_by_critics(observation, self._view)
        if extra is not None:
            seen = jnp.concatenate([seen, extra], axis=-1)
        return unrolled(networks, seen, joint)

    def _of_one(
        self,
        critic: MemoryNetwork,
        joint: Float[Array, "time worlds joint"],
        extra: Float[Array, "time worlds agents extra"] | None,
    ) -> Float[Array, "time worlds agents outputs"]:
        """Of one critic for all agents, who see and remember the same but for whose value is asked.

        Its first layer meets what they have in common once, not once for each agent.
        """
        assert isinstance(critic.network, MLP)
        scaled = scale_input(joint, critic.input_scaling)
        whose = scale_input(jnp.eye(self._players.n_agents), critic.input_scaling)
        beside = 0 if extra is None else extra.shape[-1]
        ends = np.cumsum([joint.shape[-1], len(whose), beside])
        of_joint, of_whose, of_extra, of_memory = jnp.split(critic.network.weights[0], ends)
        common = scaled @ of_joint
        if critic.unit is not None:
            common += memories(critic, joint) @ of_memory
        sums = common[:, :, None] + (whose @ of_whose)[None, None]
        if extra is not None:
            sums += scale_input(extra, critic.input_scaling) @ of_extra
        outputs = jax.vmap(critic.network.beyond)(sums.reshape(-1, sums.shape[-1]))
        return outputs.reshape(*sums.shape[:3], -1)

    def values(
        self,
        critics: MemoryNetwork,
        observation: Float[Array, "time worlds agents obs"],
        extra: Float[Array, "time worlds agents extra"] | None = None,
    ) -> Float[Array, "time worlds agents"]:
        """Of critics with one output."""
        return self(critics, observation, extra)[..., 0]
