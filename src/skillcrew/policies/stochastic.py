"""Policies that draw what they do, as policy gradients need them."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, Key, PyTree

from skillcrew.policies.dispatch import Skills
from skillcrew.policies.distributions import Categorical, Distribution, SquashedNormal, with_floor
from skillcrew.policies.holding import hold
from skillcrew.policies.memory import MemoryNetwork, PolicyConfig, for_each_agent, initial_memories
from skillcrew.policies.orthogonal import begun_orthogonally
from skillcrew.policies.team import Action, act_by_skills

LAST_GAIN = 0.01
"""Of a policy's last layer: it begins with nearly equal probabilities (Andrychowicz et al. 2021)."""

LOG_DEVIATIONS = (-4.0, 1.0)
"""Between these; of a policy that is any surer, an action's probability says nothing any more."""

LARGEST_MEAN = 3.0
"""Of an action before tanh, which leaves 0.995 of it. Beyond that 32 bits tell actions apart ever less, then
not at all: a policy that wants the most would be surer and surer of what it never sees."""

UNAVAILABLE = -1e9
"""The logit of a choice that an agent does not have."""


@dataclasses.dataclass(frozen=True)
class Options:
    """What a team's agents decide among.

    Raises:
        AssertionError: `available` of continuous actions.
    """

    size: int
    """How many choices there are, or how many numbers an action has."""
    continuous: bool = False
    """Whether they are numbers in [-1, 1]."""
    available: tuple[tuple[bool, ...], ...] = ()
    """For each agent, which of the choices it has; empty for all."""

    def __post_init__(self) -> None:
        assert not (self.continuous and self.available)

    def mask(self) -> Bool[Array, "agents choices"] | None:
        """Which choices each agent has; None for all."""
        return jnp.array(self.available) if self.available else None

    def distribution(self, outputs: Float[Array, "*batch agents outputs"]) -> Distribution:
        """What agents draw from, by the outputs of their policies."""
        if self.continuous:
            mean, log_deviation = jnp.split(outputs, 2, axis=-1)
            mean = LARGEST_MEAN * jnp.tanh(mean / LARGEST_MEAN)
            return SquashedNormal(mean, jnp.clip(log_deviation, *LOG_DEVIATIONS))
        mask = self.mask()
        if mask is None:
            return Categorical(outputs)
        return Categorical(jnp.where(jnp.broadcast_to(mask, outputs.shape), outputs, UNAVAILABLE))

    def as_numbers(self, taken: Array) -> Float[Array, "*batch agents size"]:
        """What was taken, as a row of numbers: a 1 at the place of the choice."""
        return taken if self.continuous else jax.nn.one_hot(taken, self.size)


class StochasticPolicy(eqx.Module):
    """From one agent's observation to what it draws from: logits, or means and logarithms of deviations."""

    network: MemoryNetwork
    log_deviation: Float[Array, "*any"] | None
    """Of continuous actions, whatever is observed."""

    @classmethod
    def create(
        cls, key: Key[Array, ""], observation_size: int, options: Options, config: PolicyConfig
    ) -> "StochasticPolicy":
        """Draws a policy that begins with nearly equal probabilities, or means near 0."""
        key_draw, key_weights = jax.random.split(key)
        network = MemoryNetwork.create(key_draw, observation_size, options.size, config)
        network = begun_orthogonally(key_weights, network, LAST_GAIN)
        return cls(network, jnp.full(options.size, -0.5, jnp.float32) if options.continuous else None)

    def initial_memory(self) -> Float[Array, " units"]:
        return self.network.initial_memory()

    def __call__(
        self, observation: Float[Array, " obs"], memory: Float[Array, " units"]
    ) -> tuple[Float[Array, " outputs"], Float[Array, " units"]]:
        """Outputs for `Options.distribution`, and the new memory."""
        outputs, memory = self.network(observation, memory)
        return self.with_deviation(outputs), memory

    def with_deviation(self, outputs: Float[Array, "*batch outputs"]) -> Float[Array, "*batch all"]:
        """The network's outputs, and the deviations beside them if there are any."""
        if self.log_deviation is None:
            return outputs
        return jnp.concatenate([outputs, jnp.broadcast_to(self.log_deviation, outputs.shape)], axis=-1)


class StochasticTeam(eqx.Module):
    """Each agent draws a skill, or its primitive action itself, by its policy."""

    policies: StochasticPolicy
    """Leaves have a leading axis: one policy for each agent, or a single one that all share."""
    skills: Skills | None
    """What is chosen among; None where policies give primitive actions."""
    floor: Float[Array, ""]
    """Share of the choices that are drawn evenly among all."""
    options: Options = eqx.field(static=True)
    n_agents: int = eqx.field(static=True)
    hold: int = eqx.field(static=True, default=1)
    """Least number of steps for which a choice is kept."""
    greedy: bool = eqx.field(static=True, default=False)
    """Whether the most probable action is taken instead of a drawn one."""

    def initial_memory(self) -> tuple[PyTree, Int[Array, " agents"], Int[Array, " agents"]]:
        """The policies' memory, for how many steps each choice is kept yet, and that choice (none)."""
        nothing = jnp.zeros(self.n_agents, jnp.int32)
        return initial_memories(self.policies, self.n_agents), nothing, nothing - 1

    def act(
        self, observation: Float[Array, "agents obs"], memory: PyTree, key: Key[Array, ""]
    ) -> tuple[Action, PyTree, Int[Array, " agents"]]:
        own, left, kept = memory
        outputs, own = for_each_agent(lambda policy, *seen: policy(*seen), self.policies, observation, own)
        distribution = self.options.distribution(outputs)
        if isinstance(distribution, Categorical):
            distribution = with_floor(distribution, self.floor, self.options.mask())
        taken = distribution.mode() if self.greedy else distribution.sample(key)
        if self.skills is None:
            return taken, (own, left, kept), jnp.zeros(self.n_agents, jnp.int32)
        choice, left = hold(left, kept, taken, self.hold)
        return act_by_skills(self.skills, observation, choice), (own, left, choice), choice
