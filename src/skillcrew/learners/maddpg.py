"""MADDPG and MATD3: TD3's updates with critics that see all agents (Lowe et al. 2017; Ackermann et al. 2019).

An actor sees what its agent sees. A critic is needed in training alone: it may know what all saw and did.
"""

import dataclasses
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Key

from skillcrew.errors import UserError
from skillcrew.learners.batch import Batch
from skillcrew.learners.td3 import TD3, TD3Config, TD3State
from skillcrew.policies.actor import Actor
from skillcrew.policies.critic import Critic
from skillcrew.policies.ensemble import outputs_of
from skillcrew.policies.gumbel import straight_through
from skillcrew.policies.memory import for_each_agent


@dataclasses.dataclass(frozen=True)
class MADDPGLearnerConfig(TD3Config):
    """How a team learns. MADDPG by default; MATD3 is `MADDPGLearnerConfig.matd3()`."""

    discount: float = 0.95
    """Discount γ per step (Lowe et al. 2017)."""
    soft_update: float = 0.01
    """Share τ by which targets follow (Lowe et al. 2017)."""
    actor_learning_rate: float = 1e-2
    """Adam's step size for the actors (Lowe et al. 2017)."""
    critic_learning_rate: float = 1e-2
    """Adam's step size for the critics (Lowe et al. 2017)."""
    batch_size: int = 1024
    """Environment steps of the whole team per update (Lowe et al. 2017)."""
    critics: int = 1
    """Critics of whose target values the smallest is used: 1 in MADDPG, 2 in MATD3."""
    policy_delay: int = 1
    """Critic updates per update of actors and targets: 1 in MADDPG, 2 in MATD3."""
    target_noise: float = 0.0
    """Standard deviation of the noise on continuous target actions: 0 in MADDPG, 0.2 in MATD3."""
    saturation_penalty: float = 1e-3
    """Weight of the mean square of the actor's outputs, before tanh or softmax, in its loss (Lowe et al.'s
    code)."""
    temperature: float = 1.0
    """Of the Gumbel-softmax by which gradients pass discrete actions (Lowe et al.'s code)."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.temperature > 0:
            raise UserError(f"learner.temperature = {self.temperature}: give a positive number")

    @classmethod
    def matd3(cls, **overrides: Any) -> "MADDPGLearnerConfig":
        """Twin critics, delayed actors and smoothed targets (Ackermann et al. 2019)."""
        return dataclasses.replace(cls(critics=2, policy_delay=2, target_noise=0.2), **overrides)


class MADDPGLearner(TD3):
    """`init` and `update` of a whole team; the batch's last axis is the agents'.

    Actors have leading axes [actors, policies], critics [critics, whose].

    Args:
        choices: discrete actions that each decision is made among; 0 for continuous actions.
        actors: one for each agent, or a single one that all share.
        whose: as many critics as agents, or a single one with a value for each of them.
        policies: of each agent, or of all where they share; one of them acts at a time.
    """

    config: MADDPGLearnerConfig

    def __init__(
        self,
        config: MADDPGLearnerConfig,
        n_agents: int,
        observation_size: int,
        action_size: int,
        choices: int = 0,
        actors: int = 1,
        whose: int = 1,
        policies: int = 1,
    ):
        super().__init__(config, observation_size, action_size)
        self.n_agents = n_agents
        self._choices = choices
        self._stacked = (actors, policies)
        self._whose = whose

    def init(self, key: Key[Array, ""]) -> TD3State:
        """A team that knows nothing; targets equal the networks."""
        key_actors, key_critics = jax.random.split(key)
        network, joint = self.config.network, [self.n_agents * size for size in self._sizes]
        values = 1 if self._whose == self.n_agents else self.n_agents
        actors = jax.vmap(jax.vmap(lambda k: Actor.create(k, *self._sizes, network)))(
            jax.random.split(key_actors, self._stacked)
        )
        critics = jax.vmap(jax.vmap(lambda k: Critic.create(k, *joint, network, values)))(
            jax.random.split(key_critics, (self.config.critics, self._whose))
        )
        return self._begin(actors, critics)

    def _next_action(
        self, target_actor: Actor, batch: Batch, key: Key[Array, ""]
    ) -> Float[Array, "batch agents act"]:
        """What all agents' target actors do next: in the same episode, so by the policies that acted.

        A discrete action is drawn by the target's chances, which smooths the target without further noise.
        """
        key_draw, key_noise = jax.random.split(key)
        action = self._acted(self._outputs(target_actor, batch.next_observation, batch), key_draw)
        return action if self._choices else self._smoothed(action, key_noise)

    def _values(
        self,
        critics: Critic,
        observation: Float[Array, "batch agents obs"],
        action: Float[Array, "batch agents act"],
    ) -> Float[Array, "critics batch agents"]:
        """Q_i(x, a_1 … a_N) of every agent i, x being all that agents see."""
        seen, done = _joined(observation), _joined(action)
        told = jax.vmap(jax.vmap(lambda critic: jax.vmap(critic.values)(seen, done)))(critics)
        return told[:, 0] if told.shape[1] != self.n_agents else jnp.moveaxis(told[..., 0], 1, 2)

    def _negative_values(
        self, actor: Actor, critic: Critic, batch: Batch, key: Key[Array, ""]
    ) -> Float[Array, " agents"]:
        """Minus Q_i(x, a_1 … μ_i(o_i) … a_N): own actions are the actor's, all others as they were lived.

        Of an ensemble the policy that acted is the one that is asked, so that each learns from its own
        episodes, with the weight of their share.
        """
        outputs = self._outputs(actor, batch.observation, batch)
        own = self._acted(outputs, key)
        agents = jnp.eye(self.n_agents, dtype=bool)
        instead = jnp.where(agents[:, None, :, None], own[None], batch.action[None])
        seen = _joined(batch.observation)
        values = for_each_agent(
            lambda critic, action: jax.vmap(critic.values)(seen, _joined(action)), critic, instead
        )
        of_own = values[..., 0] if values.shape[-1] == 1 else jnp.diagonal(values, axis1=0, axis2=2).T
        return self.config.saturation_penalty * (outputs**2).mean((0, 2)) - of_own.mean(1)

    def _acted(self, outputs: Float[Array, "*any act"], key: Key[Array, ""]) -> Float[Array, "*any act"]:
        if self._choices:
            return straight_through(key, outputs, self.config.temperature)
        return jnp.tanh(outputs)

    def _outputs(
        self, actors: Actor, observation: Float[Array, "batch agents obs"], batch: Batch
    ) -> Float[Array, "batch agents act"]:
        assert batch.acted is not None
        return jnp.moveaxis(outputs_of(actors, jnp.moveaxis(observation, 1, 0), batch.acted.T), 0, 1)


def _joined(of_agents: Float[Array, "batch agents size"]) -> Float[Array, "batch joint"]:
    """All agents' numbers in a row, agent by agent."""
    return of_agents.reshape(len(of_agents), -1)
