"""LIIR: learning individual intrinsic rewards (Du et al. 2019; thesis, section 2.2.1).

Each agent is paid, beside the team's reward, one that is learned for it. Policies climb the sum of both (the
proxy reward); what is learned climbs the team's reward alone, through what it makes of the policies.
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
from skillcrew.learners.on_policy.networks import Critics, Players, Policies
from skillcrew.learners.on_policy.optimiser import clipped_adam, differentiable_adam
from skillcrew.learners.on_policy.returns import advantages, paid_apart, share_paid, standardised
from skillcrew.learners.on_policy.value_scale import ValueScale
from skillcrew.policies.memory import MemoryNetwork, PolicyConfig
from skillcrew.policies.stochastic import StochasticPolicy


@dataclasses.dataclass(frozen=True)
class LIIRLearnerConfig(OnPolicyLearnerConfig):
    """How all learn. Policies and intrinsic rewards do once from a generation, critics `epochs` times."""

    section: ClassVar[str] = "liir"

    weight: float = 0.01
    """Weight λ of the intrinsic reward, which is between -1 and 1, in the proxy reward (Du et al. 2019)."""
    intrinsic_learning_rate: float = 5e-4
    """Adam's step size, of intrinsic rewards."""

    def __post_init__(self) -> None:
        super().__post_init__()
        for field in ("weight", "intrinsic_learning_rate"):
            if not getattr(self, field) > 0:
                raise UserError(self._said(field, "give a positive number"))


class LIIRState(eqx.Module):
    """Networks, their optimisers, and the scales of both kinds of returns."""

    policies: StochasticPolicy
    intrinsic: MemoryNetwork
    """Before tanh, the reward of what was observed and done."""
    proxy_critics: MemoryNetwork
    team_critics: MemoryNetwork
    policy_optimiser: optax.OptState
    intrinsic_optimiser: optax.OptState
    proxy_optimiser: optax.OptState
    team_optimiser: optax.OptState
    proxy_scale: ValueScale
    team_scale: ValueScale


class _Lived(eqx.Module):
    """What was lived, and what was thought of it then."""

    experience: Experience
    log_probability: Float[Array, "time worlds agents"]
    proxy_value: Float[Array, "later worlds agents"]
    team_advantage: Float[Array, "time worlds agents"]
    share: Float[Array, "time worlds agents"]
    """How much of advantages to follow, of both kinds and all alike: until the team is paid, what is learned
    for agents is noise."""
    team_target: Float[Array, "time worlds agents"]
    """On the scale of what critics say, as the next."""
    proxy_target: Float[Array, "time worlds agents"]


class LIIR:
    """`init` and `update` of a team's policies, critics and intrinsic rewards.

    Args:
        players: who acts.
        policy, critic: the networks of policies, and of critics and intrinsic rewards; who shares them.
    """

    def __init__(
        self, config: LIIRLearnerConfig, players: Players, policy: PolicyConfig, critic: PolicyConfig
    ):
        self.config = config
        self._options = players.options
        self._policies = Policies(players, policy)
        self._intrinsic = Critics(players, critic, "own", extra=self._options.size)
        self._proxy = Critics(players, critic, "own")
        self._team = Critics(players, critic, "joint")
        self._policy_optimiser = differentiable_adam(config.learning_rate)
        self._critic_optimiser = clipped_adam(config.learning_rate, config.longest_gradient)
        self._intrinsic_optimiser = clipped_adam(config.intrinsic_learning_rate, config.longest_gradient)

    def init(self, key: Key[Array, ""]) -> LIIRState:
        """Policies that do everything alike, rewards and critics that know nothing."""
        keys = jax.random.split(key, 4)
        policies, intrinsic = self._policies.create(keys[0]), self._intrinsic.create(keys[1])
        proxy, team = self._proxy.create(keys[2]), self._team.create(keys[3])
        return LIIRState(
            policies,
            intrinsic,
            proxy,
            team,
            self._policy_optimiser.init(policies),
            self._intrinsic_optimiser.init(intrinsic),
            self._critic_optimiser.init(proxy),
            self._critic_optimiser.init(team),
            ValueScale.create(),
            ValueScale.create(),
        )

    def floor(self, state: LIIRState) -> Float[Array, ""]:
        """None: entropy keeps policies trying."""
        del state
        return jnp.zeros(())

    def update(
        self, state: LIIRState, experience: Experience, key: Key[Array, ""]
    ) -> tuple[LIIRState, dict[str, Array]]:
        """Policies, and the rewards that they follow, learn from a generation's episodes; then critics do.

        Returns:
            The new state, and mean losses, entropy and intrinsic reward.
        """
        key_policies, key_critics = jax.random.split(key)
        state, lived = self._judged(state, experience)

        def both_levels(state: LIIRState, worlds: Array) -> tuple[LIIRState, dict[str, Array]]:
            return self._both_levels(state, jax.tree.map(lambda leaf: leaf[:, worlds], lived))

        def critic_step(state: LIIRState, worlds: Array) -> tuple[LIIRState, dict[str, Array]]:
            return self._critic_step(state, jax.tree.map(lambda leaf: leaf[:, worlds], lived))

        config, worlds = self.config, experience.worlds
        state, climbed = each_minibatch(key_policies, worlds, config.minibatches, 1, both_levels, state)
        state, learned = each_minibatch(
            key_critics, worlds, config.minibatches, config.epochs, critic_step, state
        )
        return state, {**climbed, **learned}

    def intrinsic_reward(
        self, intrinsic: MemoryNetwork, experience: Experience
    ) -> Float[Array, "time worlds agents"]:
        """What each agent is paid for what it did, between -1 and 1."""
        done = self._options.as_numbers(experience.taken)
        return jnp.tanh(self._intrinsic.values(intrinsic, experience.observation[:-1], done))

    def after_policy_step(
        self, state: LIIRState, intrinsic: MemoryNetwork, lived: _Lived
    ) -> tuple[StochasticPolicy, optax.OptState, tuple[Array, Array]]:
        """The inner level: policies after one step up the proxy reward, as a function of the intrinsic one.

        Returns:
            The policies, their optimiser, and their loss and entropy before the step.
        """
        experience = lived.experience
        reward = experience.reward + self.config.weight * self.intrinsic_reward(intrinsic, experience)
        proxy = self._advantages(reward, lived.proxy_value, experience)
        advantage = standardised(proxy, experience.decides) * lived.share

        def loss_of(policies: StochasticPolicy) -> tuple[Array, Array]:
            log_probability, entropy = self._policies.of_taken(policies, experience)
            spread = mean_where(entropy, experience.decides)
            gained = mean_where(log_probability * advantage, experience.decides)
            return -gained - self.config.entropy * spread, spread

        (loss, entropy), gradient = jax.value_and_grad(loss_of, has_aux=True)(state.policies)
        step, optimiser = self._policy_optimiser.update(gradient, state.policy_optimiser)
        return optax.apply_updates(state.policies, step), optimiser, (loss, entropy)

    def team_objective(self, policies: StochasticPolicy, lived: _Lived) -> Array:
        """The outer level's objective: how much better than before policies do by the team's reward.

        The mean of ρ A over what was done, with ρ the ratio of its probabilities after and before the step.
        """
        log_probability, _ = self._policies.of_taken(policies, lived.experience)
        ratio = jnp.exp(log_probability - lived.log_probability)
        return mean_where(ratio * lived.team_advantage, lived.experience.decides)

    def _judged(self, state: LIIRState, experience: Experience) -> tuple[LIIRState, _Lived]:
        """What policies and critics that lived it think of it."""
        team_value = state.team_scale.returns(self._team.values(state.team_critics, experience.observation))
        proxy_value = state.proxy_scale.returns(
            self._proxy.values(state.proxy_critics, experience.observation)
        )
        team_advantage = self._advantages(experience.reward, team_value, experience)
        reward = experience.reward + self.config.weight * self.intrinsic_reward(state.intrinsic, experience)
        proxy_target = self._advantages(reward, proxy_value, experience) + proxy_value[:-1]
        team_target = team_advantage + team_value[:-1]
        counts = experience.decides
        apart = paid_apart(experience.reward, experience.mask, counts, self.config.discount)
        share = jnp.broadcast_to(share_paid(team_advantage, counts, apart), team_advantage.shape)
        if self.config.normalise_values:
            state = dataclasses.replace(
                state,
                proxy_scale=state.proxy_scale.observe(proxy_target, experience.mask),
                team_scale=state.team_scale.observe(team_target, experience.mask),
            )
        return state, _Lived(
            experience,
            self._policies.of_taken(state.policies, experience)[0],
            proxy_value,
            standardised(team_advantage, counts) * share,
            share,
            state.team_scale.normalised(team_target),
            state.proxy_scale.normalised(proxy_target),
        )

    def _advantages(self, reward: Array, value: Array, experience: Experience) -> Array:
        config = self.config
        return advantages(
            reward, value, experience.terminated, experience.mask, config.discount, config.trace
        )

    def _both_levels(self, state: LIIRState, lived: _Lived) -> tuple[LIIRState, dict[str, Array]]:
        """One step of the policies, and one of the intrinsic rewards through it."""

        def outer(intrinsic: MemoryNetwork) -> tuple[Array, tuple]:
            policies, optimiser, measured = self.after_policy_step(state, intrinsic, lived)
            return -self.team_objective(policies, lived), (policies, optimiser, measured)

        (loss, (policies, optimiser, measured)), gradient = jax.value_and_grad(outer, has_aux=True)(
            state.intrinsic
        )
        step, intrinsic_optimiser = self._intrinsic_optimiser.update(gradient, state.intrinsic_optimiser)
        state = dataclasses.replace(
            state,
            policies=policies,
            policy_optimiser=optimiser,
            intrinsic=optax.apply_updates(state.intrinsic, step),
            intrinsic_optimiser=intrinsic_optimiser,
        )
        paid = mean_where(self.intrinsic_reward(state.intrinsic, lived.experience), lived.experience.decides)
        names = ("policy_loss", "entropy", "intrinsic_loss", "intrinsic_reward")
        return state, dict(zip(names, (*measured, loss, paid), strict=True))

    def _critic_step(self, state: LIIRState, lived: _Lived) -> tuple[LIIRState, dict[str, Array]]:
        """One step of both critics towards their returns."""
        seen = lived.experience.observation[:-1]
        counts = jnp.broadcast_to(lived.experience.mask[..., None], lived.team_target.shape)

        def loss_of(critics: tuple[MemoryNetwork, MemoryNetwork]) -> tuple[Array, Array]:
            proxy = mean_where((self._proxy.values(critics[0], seen) - lived.proxy_target) ** 2, counts)
            team = mean_where((self._team.values(critics[1], seen) - lived.team_target) ** 2, counts)
            return proxy + team, team

        critics = state.proxy_critics, state.team_critics
        (_, loss), (of_proxy, of_team) = jax.value_and_grad(loss_of, has_aux=True)(critics)
        proxy_step, proxy_optimiser = self._critic_optimiser.update(of_proxy, state.proxy_optimiser)
        team_step, team_optimiser = self._critic_optimiser.update(of_team, state.team_optimiser)
        state = dataclasses.replace(
            state,
            proxy_critics=optax.apply_updates(critics[0], proxy_step),
            team_critics=optax.apply_updates(critics[1], team_step),
            proxy_optimiser=proxy_optimiser,
            team_optimiser=team_optimiser,
        )
        return state, {"critic_loss": loss}
