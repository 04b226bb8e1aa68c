"""What every environment offers: pure `reset` and `step`, one world or many at once."""

import abc
import dataclasses
import re
from collections.abc import Mapping
from typing import Any, ClassVar, Literal

import equinox as eqx
import jax
from jaxtyping import Array, Bool, Float, Key, PyTree

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
    """The task is done; nothing follows, so nothing is bootstrapped."""
    truncated: Bool[Array, "*worlds"]
    """The time limit cut the episode off before the task was done."""


class Environment(abc.ABC):
    """A world in which a team acts. Write `reset` and `step` for one world and you are done.

    There is no automatic reset: whoever rolls out owns the episodes. Both functions are pure,
    so that `jax.jit`, `jax.vmap` and `jax.lax.scan` apply.
    """

    name: str
    """What files, figures and messages call it. Default: the class's name, in lower case with hyphens."""
    n_agents: int
    observation_size: int
    action_size: int
    episode_length: int
    config: Any
    """The options that it was made with, where it has a `config_class`."""
    skills: tuple[str, ...]
    """Names of the skills, in the order of the last axis of `TimeStep.local_rewards`."""
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

    @abc.abstractmethod
    def reset(self, key: Key[Array, ""]) -> tuple[PyTree, Float[Array, "agents obs"]]:
        """Draws a new world; returns its state and each agent's observation."""

    @abc.abstractmethod
    def step(
        self, state: PyTree, action: Float[Array, "agents act"], key: Key[Array, ""]
    ) -> tuple[PyTree, TimeStep]:
        """Moves every agent by its action, whose entries lie in [-1, 1]."""

    def reset_worlds(self, keys: Key[Array, " worlds"]) -> tuple[PyTree, Float[Array, "agents obs worlds"]]:
        """`reset` of one world per key; every result has the world axis last."""
        return jax.vmap(self.reset, out_axes=-1)(keys)

    def step_worlds(
        self, state: PyTree, action: Float[Array, "agents act worlds"], keys: Key[Array, " worlds"]
    ) -> tuple[PyTree, TimeStep]:
        """`step` of many worlds, the world axis last throughout.

        The largest axis last is what CPU and GPU kernels want. An environment whose arithmetic
        is already written that way overrides this method; the results must be those of `step`.
        """
        return jax.vmap(self.step, in_axes=(-1, -1, 0), out_axes=-1)(state, action, keys)

    def describe(self) -> dict[str, Any]:
        """The name and the resolved configuration, as plain values, for the run folder."""
        fields = {} if self.config_class is None else dataclasses.asdict(self.config)
        return {"name": self.name, **fields}
