"""TD3, and DDPG as its plain case (thesis, sections 2.1.6 and 2.1.7; Fujimoto et al. 2018)."""

import dataclasses
from typing import Any, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import optax
from jaxtyping import Array, Float, Key

from skillcrew.errors import UserError
from skillcrew.learners.batch import Batch
from skillcrew.policies.actor import Actor
from skillcrew.policies.critic import Critic
from skillcrew.policies.network import NetworkConfig


@dataclasses.dataclass(frozen=True)
class TD3Config:
    """How one policy learns. DDPG is `TD3Config.ddpg()`: one critic, no delay, no target noise."""

    discount: float = 0.9
    """Discount γ per step; each algorithm has a default of its own, for skills look a few steps ahead and
    actors as far as the task takes."""
    soft_update: float = 0.005
    """Share τ by which targets follow (eq. 3.4)."""
    actor_learning_rate: float = 1e-3
    """Adam's step size for the actor."""
    critic_learning_rate: float = 1e-3
    """Adam's step size for the critics."""
    batch_size: int = 256
    """Transitions T per update."""
    critics: int = 2
    """Critics whose smallest target value is used (eq. 3.1): 2 in TD3, 1 in DDPG."""
    policy_delay: int = 2
    """Critic updates per update of the actor and of the targets: 2 in TD3, 1 in DDPG."""
    target_noise: float = 0.2
    """Standard deviation ε of the noise on target actions: 0 in DDPG."""
    target_noise_clip: float = 0.5
    """Bound of that noise."""
    saturation_penalty: float = 0.0
    """Weight of the mean square of the actor's outputs before tanh in its loss, which keeps it off tanh's
    flat ends (Andrychowicz et al. 2017, appendix A). 0 is TD3 as published."""
    network: NetworkConfig = dataclasses.field(default_factory=NetworkConfig)
    """Actor's and critics' hidden layers."""

    def __post_init__(self) -> None:
        for field in ("batch_size", "critics", "policy_delay"):
            if getattr(self, field) < 1:
                raise UserError(f"learner.{field} = {getattr(self, field)}: give at least 1")
        for field in ("actor_learning_rate", "critic_learning_rate"):
            if not getattr(self, field) > 0:
                raise UserError(f"learner.{field} = {getattr(self, field)}: give a positive number")
        if not 0 <= self.discount < 1:
            raise UserError(f"learner.discount = {self.discount}: give a number from 0 to below 1")
        if not 0 < self.soft_update <= 1:
            raise UserError(f"learner.soft_update = {self.soft_update}: give a share above 0 and up to 1")
        for field in ("target_noise", "target_noise_clip", "saturation_penalty"):
            if not getattr(self, field) >= 0:
                raise UserError(f"learner.{field} = {getattr(self, field)}: give a number of at least 0")

    @classmethod
    def ddpg(cls, **overrides: Any) -> "TD3Config":
        """Deep deterministic policy gradient (thesis, section 2.1.6)."""
        return dataclasses.replace(cls(critics=1, policy_delay=1, target_noise=0.0), **overrides)


class TD3State(eqx.Module):
    """Networks, their slow targets and both optimisers. Critics have a leading critic axis."""

    actor: Actor
    critics: Critic
    target_actor: Actor
    target_critics: Critic
    actor_optimiser: optax.OptState
    critic_optimiser: optax.OptState


class TD3:
    """`init` and `update` of one learner; stack many by `jax.vmap`.

    Args:
        heads: agents of which each has a last layer of the actor; see `Actor.create`.
    """

    losses: ClassVar[tuple[str, ...]] = ("critic_loss", "actor_loss")

    def __init__(self, config: TD3Config, observation_size: int, action_size: int, heads: int = 0):
        self.config = config
        self._heads = heads
        self._sizes = (observation_size, action_size)
        self._actor_optimiser = optax.adam(config.actor_learning_rate)
        self._critic_optimiser = optax.adam(config.critic_learning_rate)

    def init(self, key: Key[Array, ""]) -> TD3State:
        """A learner that knows nothing; targets equal the networks."""
        key_actor, key_critics = jax.random.split(key)
        actor = Actor.create(key_actor, *self._sizes, self.config.network, self._heads)
        critics = jax.vmap(lambda k: Critic.create(k, *self._sizes, self.config.network))(
            jax.random.split(key_critics, self.config.critics)
        )
        return self._begin(actor, critics)

    def _begin(self, actor: Actor, critics: Critic) -> TD3State:
        # Copies, so that outside jit too every leaf has memory of its own and may be donated.
        return TD3State(
            actor=actor,
            critics=critics,
            target_actor=jax.tree.map(jnp.copy, actor),
            target_critics=jax.tree.map(jnp.copy, critics),
            actor_optimiser=self._actor_optimiser.init(actor),
            critic_optimiser=self._critic_optimiser.init(critics),
        )

    def update(
        self, state: TD3State, batches: Batch, key: Key[Array, ""]
    ) -> tuple[TD3State, dict[str, Array]]:
        """One update of the critics per batch, then one of the actor and of all targets.

        Args:
            batches: with leading axes [policy_delay, batch_size].

        Returns:
            The new state, and the mean critic and actor losses.
        """

        def one_batch(state, inputs):
            batch, key = inputs
            return self._update_critics(state, batch, key)

        keys = jax.random.split(key, self.config.policy_delay + 1)
        state, critic_losses = jax.lax.scan(one_batch, state, (batches, keys[:-1]))
        last = jax.tree.map(lambda leaf: leaf[-1], batches)
        state, actor_loss = self._update_actor(state, last, keys[-1])
        return self._update_targets(state), {"critic_loss": critic_losses.mean(), "actor_loss": actor_loss}

    def target_values(
        self, state: TD3State, batch: Batch, key: Key[Array, ""]
    ) -> Float[Array, "batch *agents"]:
        """Y = r + γ (1 - terminated) min_j Q'_j(s', clip(μ'(s') + clipped noise)) (eq. 3.1)."""
        action = self._next_action(state.target_actor, batch, key)
        smallest = self._values(state.target_critics, batch.next_observation, action).min(0)
        discount = self.config.discount if batch.discount is None else batch.discount
        return batch.reward + discount * (1 - batch.terminated) * smallest

    def _next_action(
        self, target_actor: Actor, batch: Batch, key: Key[Array, ""]
    ) -> Float[Array, "batch *agents act"]:
        """What the target actor does next, with noise."""
        return self._smoothed(jax.vmap(target_actor)(batch.next_observation), key)

    def _smoothed(self, action: Float[Array, "*any"], key: Key[Array, ""]) -> Float[Array, "*any"]:
        config = self.config
        if not config.target_noise:
            return action
        noise = config.target_noise * jax.random.normal(key, action.shape)
        noise = jnp.clip(noise, -config.target_noise_clip, config.target_noise_clip)
        return jnp.clip(action + noise, -1.0, 1.0)

    def _update_critics(self, state: TD3State, batch: Batch, key: Key[Array, ""]) -> tuple[TD3State, Array]:
        """One step on the mean square Bellman error of each critic (eq. 3.2)."""
        targets = self.target_values(state, batch, key)

        def bellman_error(critics):
            errors = self._values(critics, batch.observation, batch.action) - targets[None]
            return (errors**2).mean(1).sum()

        loss, gradient = jax.value_and_grad(bellman_error)(state.critics)
        step, optimiser = self._critic_optimiser.update(gradient, state.critic_optimiser)
        critics = optax.apply_updates(state.critics, step)
        values = self.config.critics * targets[0].size
        return dataclasses.replace(state, critics=critics, critic_optimiser=optimiser), loss / values

    def _update_actor(self, state: TD3State, batch: Batch, key: Key[Array, ""]) -> tuple[TD3State, Array]:
        """One step up the first critic's value of the actor's own action (eq. 3.3)."""
        first = jax.tree.map(lambda leaf: leaf[0], state.critics)

        def negative_values(actor):
            losses = self._negative_values(actor, first, batch, key)
            return losses.sum(), losses.mean()

        gradient, loss = jax.grad(negative_values, has_aux=True)(state.actor)
        step, optimiser = self._actor_optimiser.update(gradient, state.actor_optimiser)
        actor = optax.apply_updates(state.actor, step)
        return dataclasses.replace(state, actor=actor, actor_optimiser=optimiser), loss

    def _negative_values(
        self, actor: Actor, critic: Critic, batch: Batch, key: Key[Array, ""]
    ) -> Float[Array, "*agents"]:
        """What the actor descends on: minus the mean value of what it would do, and its penalty."""
        del key  # Nothing is drawn.
        unbounded = jax.vmap(actor.before_squashing)(batch.observation)
        value = jax.vmap(critic)(batch.observation, jnp.tanh(unbounded)).mean()
        return self.config.saturation_penalty * (unbounded**2).mean() - value

    def _update_targets(self, state: TD3State) -> TD3State:
        """θ' ← τ θ + (1 - τ) θ' for actor and critics (eq. 3.4)."""
        follow = self.config.soft_update
        return dataclasses.replace(
            state,
            target_actor=optax.incremental_update(state.actor, state.target_actor, follow),
            target_critics=optax.incremental_update(state.critics, state.target_critics, follow),
        )

    def _values(
        self,
        critics: Critic,
        observation: Float[Array, "batch *agents obs"],
        action: Float[Array, "batch *agents act"],
    ) -> Float[Array, "critics batch *agents"]:
        """Q_j(s, a) of every critic."""
        return jax.vmap(lambda critic: jax.vmap(critic)(observation, action))(critics)
