"""What every environment offers: pure `reset` and `step`, one world or many at once."""

import abc
import dataclasses
import re
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import equinox as eqx
import jax
from jaxtyping import Array, Bool, Float, Key, PyTree

from skillcrew.envs.agent_type import AgentType

ObservationScaling = Literal["symlog", "sqrt", "none"]
"""How a network brings observations to the scale on which it learns; see `Environment.input_scaling`."""


class TimeStep(eqx.Module):
    """What one environment step returns, beside the new state.

    A batch of worlds has its world axis last: `*worlds` is empty for a single world.
    """

    observation: Float[Array, "agents obs *worlds"]
    """Of the state after the action, also at the end of an episode: never the reset one."""
    local_rewards: Float[Array, "agents skills *worlds"]
    """One dense reward per agent and skill, in the order of `Environment.skills`."""
    team_reward: Float[Array, "*worlds"]
    """The sparse reward of the whole team, the same for each agent."""
    terminated: Bool[Array, "*worlds"]
    """The episode is over, and nothing follows, so nothing is bootstrapped: the task is done, or failed."""
    truncated: Bool[Array, "*worlds"]
    """The time limit cut the episode off before the task was done."""


class TimeStepByType(eqx.Module):
    """A `TimeStep` of agents that differ: with an array for each of `Environment.types`, by its name."""

    observation: Mapping[str, Float[Array, "..."]]
    """[agents, obs] of each type."""
    local_rewards: Mapping[str, Float[Array, "..."]]
    """[agents, skills] of each type."""
    team_reward: Float[Array, "*worlds"]
    terminated: Bool[Array, "*worlds"]
    truncated: Bool[Array, "*worlds"]


FROM_TYPES: Mapping[str, Callable[[tuple[AgentType, ...]], Any]] = {
    "n_agents": lambda types: sum(kind.agents for kind in types),
    "observation_size": lambda types: max(kind.observation_size for kind in types),
    "action_size": lambda types: max(kind.action_size for kind in types),
    "skills": lambda types: tuple(f"{kind.name}/{skill}" for kind in types for skill in kind.skills),
}


class Environment(abc.ABC):
    """A world in which a team acts. Write `reset` and `step` for one world and you are done.

    There is no automatic reset: whoever rolls out owns the episodes. Both functions are pure,
    so that `jax.jit`, `jax.vmap` and `jax.lax.scan` apply.
    """

    name: str
    """What files, figures and messages call it. Default: the class's name, in lower case with hyphens."""
    n_agents: int
    """How many act together."""
    observation_size: int
    """Numbers that one agent sees."""
    action_size: int
    """Numbers that one agent acts by, or actions that it chooses among; see `actions`."""
    episode_length: int
    """Steps after which an episode is cut off."""
    config: Any
    """The options that it was made with, where it has a `config_class`."""
    skills: tuple[str, ...]
    """Names of the skills, in the order of the last axis of `TimeStep.local_rewards`; none for no skills."""
    actions: Literal["continuous", "discrete"] = "continuous"
    """"continuous": `action_size` numbers in [-1, 1] for each agent. "discrete": one of `action_size`
    actions for each, by its index."""
    decisions: int = 1
    """Discrete actions that an agent takes at once. Only a wrapper that makes one agent of several has more:
    `action_size` is then that of all of them together."""
    types: tuple[AgentType, ...] = ()
    """Where agents differ: their types. `reset`'s observation and `step`'s action are then dictionaries with
    an array for each type, by its name, and `step` returns a `TimeStepByType`; `n_agents`, the largest sizes,
    and `skills`, called "type/skill", follow from the types and need not be given."""
    success: Literal["terminated"] | None = None
    """Whether "terminated" says that the task was done, so that the share of episodes that end so may be
    called the success rate. None: there is no success, only return."""
    input_scaling: ObservationScaling = "symlog"
    """What suits the observations, unless a network's own configuration says otherwise. "symlog":
    sign(x)·log(1 + |x|), linear near 0 and gentle with large numbers, for offsets, speeds and the like
    (Hafner et al. 2023). "sqrt": 2·sign(x)·√|x|, which turns a sensor's 1/δ² into 2/δ. "none": unchanged."""
    config_class: ClassVar[Any] = None
    """A frozen dataclass of options, if it has any: `__init__` takes one and keeps it as `config`. Its fields
    are options of the command line, their docstrings the help."""
    presets: ClassVar[Mapping[str, Any]] = {}
    """Named configurations, each an instance of `config_class`."""

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        if "name" not in cls.__dict__:
            cls.name = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "-", cls.__name__).lower()

    if not TYPE_CHECKING:  # Or no attribute would be unknown to a type checker.

        def __getattr__(self, name: str) -> Any:
            """What follows from the types of agents, where it is not given."""
            if name in FROM_TYPES and self.types:
                return FROM_TYPES[name](self.types)
            raise AttributeError(f"{type(self).__name__} has no {name}", name=name, obj=self)

    @property
    def choices(self) -> int:
        """Among how many actions a decision is made where they are discrete; 0 where they are continuous."""
        return self.action_size // self.decisions if self.actions == "discrete" else 0

    @abc.abstractmethod
    def reset(self, key: Key[Array, ""]) -> tuple[PyTree, Any]:
        """Draws a new world; returns its state and each agent's observation, as in a `TimeStep`."""

    @abc.abstractmethod
    def step(self, state: PyTree, action: Any, key: Key[Array, ""]) -> tuple[PyTree, Any]:
        """Moves every agent by its action; returns the new state and a `TimeStep`.

        Args:
            action: Float[Array, "agents act"] with entries in [-1, 1], or Int[Array, " agents"] with the
                indices of discrete ones; where agents differ, a dictionary of such arrays, by type.
        """

    def reset_worlds(self, keys: Key[Array, " worlds"]) -> tuple[PyTree, Any]:
        """`reset` of one world per key; every result has the world axis last."""
        return jax.vmap(self.reset, out_axes=-1)(keys)

    def step_worlds(self, state: PyTree, action: Any, keys: Key[Array, " worlds"]) -> tuple[PyTree, Any]:
        """`step` of many worlds, the world axis last throughout.

        The largest axis last is what CPU and GPU kernels want. An environment whose arithmetic
        is already written that way overrides this method; the results must be those of `step`.
        """
        return jax.vmap(self.step, in_axes=(-1, -1, 0), out_axes=-1)(state, action, keys)

    def describe(self) -> dict[str, Any]:
        """The name and the resolved configuration, as plain values, for the run folder."""
        fields = {} if self.config_class is None else dataclasses.asdict(self.config)
        return {"name": self.name, **fields}
