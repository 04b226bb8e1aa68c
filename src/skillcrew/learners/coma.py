"""COMA: counterfactual multi-agent policy gradients (Foerster et al. 2018; thesis, section 2.2.3)."""

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
from skillcrew.learners.on_policy.networks import Critics, Players, Policies
from skillcrew.learners.on_policy.optimiser import clipped_adam
from skillcrew.learners.on_policy.returns import paid_apart, returns, share_paid, standardised
from skillcrew.learners.on_policy.value_scale import ValueScale
from skillcrew.policies.distributions import Categorical, with_floor
from skillcrew.policies.memory import MemoryNetwork, PolicyConfig
from skillcrew.policies.stochastic import StochasticPolicy


@dataclasses.dataclass(frozen=True)
class COMALearnerConfig(OnPolicyLearnerConfig):
    """How policies and the critic learn. Policies learn once from a generation, the critic `epochs` times."""

    section: ClassVar[str] = "coma"

    trace: float = 0.8
    """λ of the critic's targets, TD(λ) (Foerster et al. 2018)."""
    first_floor: float = 0.5
    """Share of the choices that are drawn evenly among all, in the beginning (Foerster et al. 2018)."""
    last_floor: float = 0.02
    """The same once `floor_episodes` are lived; it falls evenly until then."""
    floor_episodes: int = 750
    """Episodes in which the share falls (Foerster et al. 2018)."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.floor_episodes < 1:
            raise UserError(self._said("floor_episodes", "give at least 1"))
        for field in ("first_floor", "last_floor"):
            if not 0 <= getattr(self, field) < 1:
                raise UserError(self._said(field, "give a share from 0 to below 1"))


class COMAState(eqx.Module):
    """Networks, optimisers, the scale of returns, and how many episodes were learned from."""

    policies: StochasticPolicy
    critics: MemoryNetwork
    policy_optimiser: optax.OptState
    critic_optimiser: optax.OptState
    scale: ValueScale
    episodes: Float[Array, ""]


class _Lived(eqx.Module):
    """What was lived, what was done by everybody else, and what the critic is to say of it."""

    experience: Experience
    others: Float[Array, "time worlds agents done"]
    target: Float[Array, "time worlds agents"]
    """On the scale of what critics say."""


class COMA:
    """`init` and `update` of a team's policies and critic.

    Args:
        players: who acts; they choose.
        policy, critic: their networks, and who shares them.
    """

    def __init__(
        self, config: COMALearnerConfig, players: Players, policy: PolicyConfig, critic: PolicyConfig
    ):
        self.config = config
        self._options = players.options
        self._n_agents = players.n_agents
        self._policies = Policies(players, policy)
        done = players.n_agents * self._options.size
        self._critics = Critics(players, critic, "joint", done, self._options.size)
        self._optimiser = clipped_adam(config.learning_rate, config.longest_gradient)

    def init(self, key: Key[Array, ""]) -> COMAState:
        """Policies that do everything alike, and a critic that knows nothing."""
        key_policies, key_critics = jax.random.split(key)
        policies, critics = self._policies.create(key_policies), self._critics.create(key_critics)
        started = self._optimiser.init(policies), self._optimiser.init(critics)
        return COMAState(policies, critics, *started, ValueScale.create(), jnp.zeros(()))

    def floor(self, state: COMAState) -> Float[Array, ""]:
        """Share of the choices that are drawn evenly among all."""
        config = self.config
        past = jnp.minimum(state.episodes / config.floor_episodes, 1.0)
        return config.first_floor + past * (config.last_floor - config.first_floor)

    def update(
        self, state: COMAState, experience: Experience, key: Key[Array, ""]
    ) -> tuple[COMAState, dict[str, Array]]:
        """The critic learns from a generation's episodes, then policies do with what it says of them.

        Returns:
            The new state, and the mean losses and entropy.
        """
        key_sample, key_critic, key_policies = jax.random.split(key, 3)
        floor = self.floor(state)
        state, lived = self._judged(state, experience, floor, key_sample)

        def critic_step(state: COMAState, worlds: Array) -> tuple[COMAState, dict[str, Array]]:
            return self._critic_step(state, jax.tree.map(lambda leaf: leaf[:, worlds], lived))

        config, worlds = self.config, experience.worlds
        state, learned = each_minibatch(
            key_critic, worlds, config.minibatches, config.epochs, critic_step, state
        )
        said = self._critics(state.critics, experience.observation[:-1], lived.others)
        values = state.scale.returns(said)
        apart = paid_apart(experience.reward, experience.mask, experience.decides, config.discount)

        def policy_step(state: COMAState, worlds: Array) -> tuple[COMAState, dict[str, Array]]:
            return self._policy_step(state, experience.of(worlds), values[:, worlds], floor, apart)

        state, climbed = each_minibatch(key_policies, worlds, config.minibatches, 1, policy_step, state)
        return dataclasses.replace(state, episodes=state.episodes + float(worlds)), {**learned, **climbed}

    def _judged(
        self, state: COMAState, experience: Experience, floor: Float[Array, ""], key: Key[Array, ""]
    ) -> tuple[COMAState, _Lived]:
        """TD(λ) targets of what was done, by the critic as it was before it learns from these episodes.

        After a time limit nothing was done; what policies would do there is drawn.
        """
        drawn = self._distribution(state.policies, experience.observation, floor).sample(key)
        lived = jnp.concatenate([experience.mask, jnp.zeros_like(experience.mask[:1])])[..., None]
        done = jnp.concatenate([experience.taken, jnp.zeros_like(experience.taken[:1])])
        done = jnp.where(lived, done, drawn)
        others = self._of_others(done)
        values = self._critics(state.critics, experience.observation, others)
        of_done = state.scale.returns(jnp.take_along_axis(values, done[..., None], axis=-1)[..., 0])
        target = returns(
            experience.reward,
            of_done,
            experience.terminated,
            experience.mask,
            self.config.discount,
            self.config.trace,
        )
        if self.config.normalise_values:
            state = dataclasses.replace(state, scale=state.scale.observe(target, experience.mask))
        return state, _Lived(experience, others[:-1], state.scale.normalised(target))

    def _of_others(self, done: Array) -> Float[Array, "time worlds agents done"]:
        """What all agents did, for each agent with zeros in its own place."""
        joint = self._options.as_numbers(done)[:, :, None]
        other = 1.0 - jnp.eye(self._n_agents, dtype=joint.dtype)
        return (joint * other[None, None, :, :, None]).reshape(*done.shape, -1)

    def _distribution(
        self, policies: StochasticPolicy, observation: Array, floor: Float[Array, ""]
    ) -> Categorical:
        distribution = self._policies.distributions(policies, observation)
        assert isinstance(distribution, Categorical)
        return with_floor(distribution, floor, self._options.mask())

    def _critic_step(self, state: COMAState, lived: _Lived) -> tuple[COMAState, dict[str, Array]]:
        """One step of the critic towards its targets, of what was done."""
        experience = lived.experience

        def loss_of(critics: MemoryNetwork) -> Array:
            values = self._critics(critics, experience.observation[:-1], lived.others)
            of_done = jnp.take_along_axis(values, experience.taken[..., None], axis=-1)[..., 0]
            counts = jnp.broadcast_to(experience.mask[..., None], of_done.shape)
            return mean_where((of_done - lived.target) ** 2, counts)

        loss, gradient = jax.value_and_grad(loss_of)(state.critics)
        step, optimiser = self._optimiser.update(gradient, state.critic_optimiser)
        critics = optax.apply_updates(state.critics, step)
        return dataclasses.replace(state, critics=critics, critic_optimiser=optimiser), {"critic_loss": loss}

    def _policy_step(
        self,
        state: COMAState,
        experience: Experience,
        values: Float[Array, "time worlds agents choices"],
        floor: Float[Array, ""],
        apart: Float[Array, ""],
    ) -> tuple[COMAState, dict[str, Array]]:
        """One step of the policies up the counterfactual advantages."""

        def loss_of(policies: StochasticPolicy) -> tuple[Array, Array]:
            distribution = self._distribution(policies, experience.observation[:-1], floor)
            probabilities = jax.lax.stop_gradient(distribution.probabilities())
            advantage = counterfactual_advantage(values, probabilities, experience.taken)
            counts = experience.decides
            scaled = standardised(advantage, counts) * share_paid(advantage, counts, apart)
            gained = distribution.log_probability(experience.taken) * scaled
            spread = mean_where(distribution.entropy(), counts)
            return -mean_where(gained, counts) - self.config.entropy * spread, spread

        (loss, entropy), gradient = jax.value_and_grad(loss_of, has_aux=True)(state.policies)
        step, optimiser = self._optimiser.update(gradient, state.policy_optimiser)
        policies = optax.apply_updates(state.policies, step)
        state = dataclasses.replace(state, policies=policies, policy_optimiser=optimiser)
        return state, {"policy_loss": loss, "entropy": entropy}


def counterfactual_advantage(
    values: Float[Array, "*batch choices"], probabilities: Float[Array, "*batch choices"], taken: Array
) -> Float[Array, "*batch"]:
    """A_i = Q(s, u) - Σ_u' π_i(u') Q(s, (u_-i, u')): better than what the agent would do on average.

    Args:
        values: Q of each of an agent's own choices, all others doing what they did.
        taken: the agent's own choice, which the second term does not depend on.
    """
    of_taken = jnp.take_along_axis(values, taken[..., None], axis=-1)[..., 0]
    return of_taken - (probabilities * values).sum(-1)
