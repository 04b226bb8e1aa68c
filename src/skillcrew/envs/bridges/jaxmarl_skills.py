"""Local rewards on top of a JaxMARL environment, as functions of what happened in it."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array

from skillcrew.envs.bridges.host_config import reward_function
from skillcrew.envs.bridges.jaxmarl_agents import Group
from skillcrew.envs.bridges.jaxmarl_config import Skills
from skillcrew.errors import UserError, place_of_failure, unknown_name

OWN_REWARD = "own_reward"
"""The one skill where none is given: what JaxMARL pays the agent itself."""

Reward = Callable[..., Any]
"""`(state, observation, action)`, all as JaxMARL has them, state and observation after the step: rewards, as
an array with a number for each agent, or as a dictionary of numbers, by agent, for some types of agents."""


@dataclasses.dataclass(frozen=True)
class LocalRewards:
    """The skills of each group of agents, and what they are paid."""

    agents: tuple[str, ...]
    """All, in the order of JaxMARL's own list."""
    functions: Mapping[str, Reward]
    """By skill; none where agents are paid JaxMARL's own rewards."""
    names: Mapping[str, tuple[str, ...]]
    """The skills of each group."""

    @classmethod
    def of(
        cls, skills: Skills, agents: Sequence[str], groups: Sequence[Group], shapes: tuple[Any, ...]
    ) -> "LocalRewards":
        """Imports what is named, and finds out which agents each skill is for.

        Args:
            shapes: what a reward function is called with, by shape.

        Raises:
            UserError: a function that cannot be imported, fails, or does not give a number for each agent.
        """
        if not skills:
            return cls(tuple(agents), {}, {group.name: (OWN_REWARD,) for group in groups})
        functions = {name: reward_function(name, given) for name, given in skills.items()}
        paid = {
            name: _paid_agents(name, function, agents, groups, shapes) for name, function in functions.items()
        }
        names = {
            group.name: tuple(name for name in skills if group.agents[0] in paid[name]) for group in groups
        }
        return cls(tuple(agents), functions, names)

    def __call__(
        self, groups: Sequence[Group], happened: tuple[Any, ...], own: Mapping[str, Array]
    ) -> dict[str, Array]:
        """[agents, skills] of each group.

        Args:
            happened: what reward functions are called with.
            own: JaxMARL's own rewards.
        """
        paid = {name: self._by_agent(function(*happened)) for name, function in self.functions.items()}
        paid = paid or {OWN_REWARD: own}
        return {group.name: self._of_group(group, paid) for group in groups}

    def _by_agent(self, rewards: Any) -> Mapping[str, Array]:
        return rewards if isinstance(rewards, Mapping) else dict(zip(self.agents, rewards, strict=True))

    def _of_group(self, group: Group, paid: Mapping[str, Mapping[str, Array]]) -> Array:
        rewards = [[paid[name][agent] for name in self.names[group.name]] for agent in group.agents]
        return jnp.asarray(rewards, jnp.float32)


def _paid_agents(
    name: str, function: Reward, agents: Sequence[str], groups: Sequence[Group], shapes: tuple[Any, ...]
) -> set[str]:
    """Those that a skill is for, all of a group or none.

    Raises:
        UserError: the function fails, or does not give one number for each of them.
    """
    try:
        rewards = jax.eval_shape(function, *shapes)
    except Exception as error:
        # Whatever it is, it is the user's code that raised it.
        said = (str(error).splitlines() or [""])[0]
        raise UserError(
            f"skills: {name}(state, observation, action) fails with {type(error).__name__}: {said} "
            f"({place_of_failure(error)})"
        ) from error
    if not isinstance(rewards, Mapping):
        found = getattr(rewards, "shape", None)
        if found != (len(agents),):
            what = type(rewards).__name__ if found is None else f"the shape {found}"
            raise UserError(
                f"skills: {name} gives {what}; give the shape ({len(agents)},), one reward for each agent, "
                "or a dictionary of single rewards by agent"
            )
        return set(agents)
    for agent, reward in rewards.items():
        if agent not in agents:
            raise unknown_name(f"agent in what skill {name} gives", str(agent), agents)
        if getattr(reward, "shape", None) != ():
            found = getattr(reward, "shape", None)
            raise UserError(f"skills: {name} gives {agent} the shape {found}; give (), a single reward")
    for group in groups:
        unpaid = [agent for agent in group.agents if agent not in rewards]
        if unpaid and (len(unpaid) < len(group.agents) or len(groups) == 1):
            raise UserError(
                f"skills: {name} gives no reward for {unpaid[0]}; give one to all agents of type {group.name}"
            )
    return set(rewards)
