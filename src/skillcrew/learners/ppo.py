"""PPO: proximal policy optimisation (Schulman et al. 2017), of the agents of a team.

Critics that see their own agent alone make it IPPO (de Witt et al. 2020), critics that see all of them
MAPPO (Yu et al. 2022).
"""

import dataclasses
from typing import ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import optax
from jaxtyping import Array, Float, Key

from skillcrew.errors import UserError
from skillcrew.learners.on_policy.config import OnPolicyLearnerConfig
from skillcrew.learners.on_policy.experience import Experience, each_minibatch, mean_where
from skillcrew.learners.on_policy.networks import Critics, Players, Policies, View
from skillcrew.learners.on_policy.optimiser import clipped_adam
from skillcrew.learners.on_policy.returns import advantages, paid_apart, share_paid, standardised
from skillcrew.learners.on_policy.value_scale import ValueScale
from skillcrew.policies.memory import MemoryNetwork, PolicyConfig
from skillcrew.policies.stochastic import StochasticPolicy


@dataclasses.dataclass(frozen=True)
class PPOConfig(OnPolicyLearnerConfig):
    """How policies and critics learn. Defaults are those of Yu et al. (2022), but for `minibatches`."""

    section: ClassVar[str] = "ppo"

    learning_rate: float = 7e-4
    """Adam's step size, of policies and critics (Yu et al. 2022)."""
    clip: float = 0.2
    """How far an action's probability may move from what it was, as a share (Schulman et al. 2017)."""
    value_clip: float | None = 0.2
    """How far a value may move from what it was, in deviations of returns. None: as far as it wants."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.clip > 0:
            raise UserError(self._said("clip", "give a positive number"))
        if self.value_clip is not None and not self.value_clip > 0:
            raise UserError(self._said("value_clip", "give a positive number, or None for no bound"))


class PPOState(eqx.Module):
    """Networks, optimisers, and the scale of returns."""

    policies: StochasticPolicy
    critics: MemoryNetwork
    policy_optimiser: optax.OptState
    critic_optimiser: optax.OptState
    scale: ValueScale


class _Lived(eqx.Module):
    """What was lived, and what was thought of it then."""

    experience: Experience
    log_probability: Float[Array, "time worlds agents"]
    value: Float[Array, "time worlds agents"]
    """Normalised, like the targets."""
    advantage: Float[Array, "time worlds agents"]
    target: Float[Array, "time worlds agents"]


class PPO:
    """`init` and `update` of a team's policies and critics.

    Args:
        players: who acts.
        policy, critic: their networks, and who shares them.
        view: what critics see.
    """

    def __init__(
        self, config: PPOConfig, players: Players, policy: PolicyConfig, critic: PolicyConfig, view: View
    ):
        self.config = config
        self._policies = Policies(players, policy)
        self._critics = Critics(players, critic, view)
        self._optimiser = clipped_adam(config.learning_rate, config.longest_gradient)

    def init(self, key: Key[Array, ""]) -> PPOState:
        """Policies that do everything alike, and critics that know nothing."""
        key_policies, key_critics = jax.random.split(key)
        policies, critics = self._policies.create(key_policies), self._critics.create(key_critics)
        started = self._optimiser.init(policies), self._optimiser.init(critics)
        return PPOState(policies, critics, *started, ValueScale.create())

    def floor(self, state: PPOState) -> Float[Array, ""]:
        """None: entropy keeps policies trying."""
        del state
        return jnp.zeros(())

    def update(
        self, state: PPOState, experience: Experience, key: Key[Array, ""]
    ) -> tuple[PPOState, dict[str, Array]]:
        """Learns from a generation's episodes, several times over.

        Returns:
            The new state, and the mean losses and entropy.
        """
        state, lived = self._judged(state, experience)

        def one_minibatch(state: PPOState, worlds: Array) -> tuple[PPOState, dict[str, Array]]:
            return self._step(state, jax.tree.map(lambda leaf: leaf[:, worlds], lived))

        config = self.config
        return each_minibatch(key, experience.worlds, config.minibatches, config.epochs, one_minibatch, state)

    def _judged(self, state: PPOState, experience: Experience) -> tuple[PPOState, _Lived]:
        """What the policies and critics that lived it think of it: probabilities, advantages, targets."""
        config = self.config
        said = self._critics.values(state.critics, experience.observation)
        value = state.scale.returns(said)
        advantage = advantages(
            experience.reward, value, experience.terminated, experience.mask, config.discount, config.trace
        )
        target = advantage + value[:-1]
        if config.normalise_values:
            state = dataclasses.replace(state, scale=state.scale.observe(target, experience.mask))
        counts = experience.decides
        apart = paid_apart(experience.reward, experience.mask, counts, config.discount)
        lived = _Lived(
            experience,
            self._policies.of_taken(state.policies, experience)[0],
            # On the scale of now, so that the bound of `value_clip` is one on what critics learn.
            state.scale.normalised(value[:-1]),
            standardised(advantage, counts) * share_paid(advantage, counts, apart),
            state.scale.normalised(target),
        )
        return state, lived

    def _step(self, state: PPOState, lived: _Lived) -> tuple[PPOState, dict[str, Array]]:
        """One step of policies and critics on a minibatch."""
        (policy_loss, entropy), gradient = jax.value_and_grad(self._policy_loss, has_aux=True)(
            state.policies, lived
        )
        critic_loss, critic_gradient = jax.value_and_grad(self._critic_loss)(state.critics, lived)
        step, policy_optimiser = self._optimiser.update(gradient, state.policy_optimiser)
        critic_step, critic_optimiser = self._optimiser.update(critic_gradient, state.critic_optimiser)
        state = PPOState(
            optax.apply_updates(state.policies, step),
            optax.apply_updates(state.critics, critic_step),
            policy_optimiser,
            critic_optimiser,
            state.scale,
        )
        return state, {"policy_loss": policy_loss, "critic_loss": critic_loss, "entropy": entropy}

    def _policy_loss(self, policies: StochasticPolicy, lived: _Lived) -> tuple[Array, Array]:
        """-min(ρ A, clip(ρ, 1 - ε, 1 + ε) A), less the entropy; of the steps at which there was a choice."""
        log_probability, entropy = self._policies.of_taken(policies, lived.experience)
        # An action that has become so much likelier is beyond any clip, and its ratio is not to be infinite.
        ratio = jnp.exp(jnp.minimum(log_probability - lived.log_probability, 20.0))
        bounded = jnp.clip(ratio, 1 - self.config.clip, 1 + self.config.clip)
        gained = jnp.minimum(ratio * lived.advantage, bounded * lived.advantage)
        spread = mean_where(entropy, lived.experience.decides)
        return -mean_where(gained, lived.experience.decides) - self.config.entropy * spread, spread

    def _critic_loss(self, critics: MemoryNetwork, lived: _Lived) -> Array:
        """The larger of the square errors of the value and of the value that did not move far."""
        said = self._critics.values(critics, lived.experience.observation[:-1])
        error = (said - lived.target) ** 2
        if self.config.value_clip is not None:
            near = lived.value + jnp.clip(said - lived.value, -self.config.value_clip, self.config.value_clip)
            error = jnp.maximum(error, (near - lived.target) ** 2)
        counts = jnp.broadcast_to(lived.experience.mask[..., None], error.shape)
        return 0.5 * mean_where(error, counts)
