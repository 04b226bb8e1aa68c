"""DQN: values of discrete actions (Mnih et al. 2015), double (van Hasselt et al. 2016) and dueling."""

import dataclasses
from typing import ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import optax
from jaxtyping import Array, Float, Key

from skillcrew.errors import UserError
from skillcrew.learners.batch import Batch
from skillcrew.policies.action_values import ActionValues
from skillcrew.policies.network import NetworkConfig


@dataclasses.dataclass(frozen=True)
class DQNConfig:
    """How one policy over discrete actions learns."""

    discount: float = 0.9
    """Discount γ per step."""
    soft_update: float = 0.005
    """Share τ by which the target network follows in each update."""
    learning_rate: float = 1e-3
    """Adam's step size."""
    batch_size: int = 256
    """Transitions per update."""
    double: bool = True
    """Whether the network picks the next action and its target only values it (van Hasselt et al. 2016)."""
    dueling: bool = False
    """Whether a state's value and its actions' advantages are told apart (Wang et al. 2016)."""
    network: NetworkConfig = dataclasses.field(default_factory=NetworkConfig)
    """Hidden layers."""

    policy_delay: ClassVar[int] = 1
    """Batches per round of updates; TD3 has more."""

    def __post_init__(self) -> None:
        if self.batch_size < 1:
            raise UserError(f"dqn.batch_size = {self.batch_size}: give at least 1")
        if not self.learning_rate > 0:
            raise UserError(f"dqn.learning_rate = {self.learning_rate}: give a positive number")
        if not 0 <= self.discount < 1:
            raise UserError(f"dqn.discount = {self.discount}: give a number from 0 to below 1")
        if not 0 < self.soft_update <= 1:
            raise UserError(f"dqn.soft_update = {self.soft_update}: give a share above 0 and up to 1")


class DQNState(eqx.Module):
    """The network, its slow target and the optimiser. The best valued action is what it does."""

    actor: ActionValues
    target_actor: ActionValues
    optimiser: optax.OptState


class DQN:
    """`init` and `update` of one learner, as `TD3` has them; stack many by `jax.vmap`.

    Args:
        heads: agents of which each has a last layer; see `ActionValues.create`.
        decisions: discrete actions that an actor takes at once, such as those of all agents; each has its
            own `action_size / decisions` values, and the value of all is their sum (Sunehag et al. 2018).
    """

    losses: ClassVar[tuple[str, ...]] = ("value_loss",)

    def __init__(
        self,
        config: DQNConfig,
        observation_size: int,
        action_size: int,
        heads: int = 0,
        decisions: int = 1,
    ):
        self.config = config
        self._sizes = (observation_size, action_size)
        self._heads = heads
        self._decisions = decisions
        self._optimiser = optax.adam(config.learning_rate)

    def init(self, key: Key[Array, ""]) -> DQNState:
        """A learner that knows nothing; the target equals the network."""
        actor = ActionValues.create(key, *self._sizes, self.config.network, self._heads, self.config.dueling)
        return DQNState(actor, jax.tree.map(jnp.copy, actor), self._optimiser.init(actor))

    def update(
        self, state: DQNState, batches: Batch, key: Key[Array, ""]
    ) -> tuple[DQNState, dict[str, Array]]:
        """One update of the network per batch, each followed by the target.

        Args:
            batches: with leading axes [policy_delay, batch_size].

        Returns:
            The new state, and the mean loss.
        """
        del key  # Nothing is drawn.
        state, losses = jax.lax.scan(self._update, state, batches)
        return state, {"value_loss": losses.mean()}

    def target_values(self, state: DQNState, batch: Batch) -> Float[Array, " batch"]:
        """Y = r + γ (1 - terminated) Q'(s', argmax Q(s', ·)); with `double` off, of Q' itself."""
        follow = self._by_decision(jax.vmap(state.target_actor)(batch.next_observation))
        judge = self._by_decision(jax.vmap(state.actor)(batch.next_observation))
        best = jnp.argmax(judge if self.config.double else follow, axis=-1)
        after = jnp.take_along_axis(follow, best[..., None], axis=-1).sum((-2, -1))
        discount = self.config.discount if batch.discount is None else batch.discount
        return batch.reward + discount * (1 - batch.terminated) * after

    def _update(self, state: DQNState, batch: Batch) -> tuple[DQNState, Array]:
        targets = self.target_values(state, batch)

        def bellman_error(actor: ActionValues) -> Array:
            taken = (jax.vmap(actor)(batch.observation) * batch.action).sum(-1)
            return ((taken - targets) ** 2).mean()

        loss, gradient = jax.value_and_grad(bellman_error)(state.actor)
        step, optimiser = self._optimiser.update(gradient, state.optimiser)
        actor = optax.apply_updates(state.actor, step)
        target = optax.incremental_update(actor, state.target_actor, self.config.soft_update)
        return DQNState(actor, target, optimiser), loss

    def _by_decision(self, values: Float[Array, "batch act"]) -> Float[Array, "batch decisions choices"]:
        return values.reshape(len(values), self._decisions, -1)
