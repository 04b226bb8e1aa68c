"""Environments of JaxMARL as ours: skills on top, time limits told from endings, agents by type."""

import dataclasses
from collections.abc import Mapping
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, Key, PyTree

from skillcrew.conditional import run_unless
from skillcrew.envs.agent_type import AgentType
from skillcrew.envs.bridges.jaxmarl_agents import check_observations, groups_of, is_discrete
from skillcrew.envs.bridges.jaxmarl_config import JaxMARLConfig
from skillcrew.envs.bridges.jaxmarl_package import (
    make_world,
    own_limit,
    reaches_limit,
    without_limit,
)
from skillcrew.envs.bridges.jaxmarl_skills import LocalRewards
from skillcrew.envs.environment import Environment, TimeStep, TimeStepByType
from skillcrew.envs.importing import import_path
from skillcrew.errors import UserError


class JaxMARLState(eqx.Module):
    """A world of JaxMARL, and how long it has been going on."""

    world: PyTree
    """JaxMARL's own state."""
    time: Int[Array, "*worlds"]


class JaxMARLEnvironment(Environment):
    """Any environment of JaxMARL. Its automatic reset is not used, and masks of actions are not looked at.

    Agents that see and do as much and are called alike, such as `adversary_0` and `adversary_1`, are of one
    type. Where there is one type only, arrays have a row for each of JaxMARL's agents, in their order.

    Raises:
        UserError: JaxMARL is not installed, has no such environment, or cannot make it so; there is no time
            limit; or a skill cannot be imported, or gives something else than a number for each agent.
    """

    config_class = JaxMARLConfig

    def __init__(self, config: JaxMARLConfig):
        self.world = make_world(config.env_id, config.options)
        self.name = config.called()
        self.episode_length = _length(config, own_limit(self.world))
        self.config = dataclasses.replace(config, episode_length=self.episode_length)
        self._reaches_limit = reaches_limit(self.world, self.episode_length)
        self._unlimited = without_limit(self.world)
        observation, state = jax.eval_shape(self.world.reset, jax.random.key(0))
        check_observations(config.env_id, self.world.agents, observation)
        self._groups = groups_of(self.world, observation)
        self.actions = "discrete" if is_discrete(self._groups[0].spaces[0]) else "continuous"
        actions = {
            agent: jax.ShapeDtypeStruct(space.shape, space.dtype)
            for group in self._groups
            for agent, space in zip(group.agents, group.spaces, strict=True)
        }
        self._local_rewards = LocalRewards.of(
            config.skills, self.world.agents, self._groups, (state, observation, actions)
        )
        types = tuple(
            AgentType(
                group.name,
                len(group.agents),
                group.observation_size,
                group.action_size,
                self._local_rewards.names[group.name],
            )
            for group in self._groups
        )
        if len(types) > 1:
            self.types = types
        else:
            (only,) = types
            self.n_agents, self.skills = only.agents, only.skills
            self.observation_size, self.action_size = only.observation_size, only.action_size

    def reset(self, key: Key[Array, ""]) -> tuple[JaxMARLState, Any]:
        observation, world = self.world.reset(key)
        return JaxMARLState(_strong(world), jnp.zeros((), jnp.int32)), self._observed(observation)

    def step(self, state: JaxMARLState, action: Any, key: Key[Array, ""]) -> tuple[JaxMARLState, Any]:
        actions: dict[str, Array] = {}
        for group in self._groups:
            actions |= group.acted(action[group.name] if self.types else action)
        observation, world, rewards, done, _ = self.world.step_env(key, state.world, actions)
        time = state.time + 1
        last = time >= self.episode_length
        terminated = self._terminated(_over(done), last, (key, state.world, actions))
        own = {agent: jnp.asarray(rewards[agent], jnp.float32).reshape(()) for agent in self.world.agents}
        local = self._local_rewards(self._groups, (world, observation, actions), own)
        timestep = (TimeStepByType if self.types else TimeStep)(
            observation=self._observed(observation),
            local_rewards=self._for_types(local),
            team_reward=self._team_reward(own),
            terminated=terminated,
            truncated=last & ~terminated,
        )
        return JaxMARLState(_strong(world), time), timestep

    def _terminated(
        self, over: Bool[Array, ""], last: Bool[Array, ""], step: tuple[Any, Any, Any]
    ) -> Bool[Array, ""]:
        """Whether it is the task that is over: JaxMARL does not tell that from running out of time.

        Args:
            step: what was given to JaxMARL's `step_env`.
        """
        if not self._reaches_limit:
            return over
        if (unlimited := self._unlimited) is None:
            return over & ~last

        def without_limit(over: Bool[Array, ""]) -> Bool[Array, ""]:
            # What does not depend on the loop would be taken out of it, and done at every step.
            _, inputs = jax.lax.optimization_barrier((over, step))
            return _over(unlimited.step_env(*inputs)[3])

        return run_unless(~(over & last), without_limit, over)

    def describe(self) -> dict[str, Any]:
        config = {field.name: getattr(self.config, field.name) for field in dataclasses.fields(self.config)}
        # By import paths that hold from other folders, too.
        skills = {name: import_path(function) for name, function in self._local_rewards.functions.items()}
        return {"name": self.name, **config, "options": dict(self.config.options), "skills": skills}

    def _observed(self, observation: Mapping[str, Array]) -> Any:
        return self._for_types({group.name: group.observed(observation) for group in self._groups})

    def _for_types(self, arrays: dict[str, Array]) -> Any:
        return arrays if self.types else arrays[self._groups[0].name]

    def _team_reward(self, own: Mapping[str, Array]) -> Float[Array, ""]:
        rewards = jnp.stack([own[agent] for agent in self.world.agents])
        if self.config.team_reward == "first":
            return rewards[0]
        return rewards.sum() if self.config.team_reward == "sum" else rewards.mean()


def _over(done: Mapping[str, Any]) -> Bool[Array, ""]:
    return jnp.asarray(done["__all__"], bool).reshape(())


def _length(config: JaxMARLConfig, limit: int | None) -> int:
    asked = config.episode_length
    if asked is None:
        if limit is None:
            raise UserError(f"episode_length: {config.env_id} has no time limit of its own; give one")
        return limit
    if limit is not None and asked > limit:
        raise UserError(
            f"episode_length = {asked}: {config.env_id} itself ends after {limit} steps; give at most that, "
            "or a higher limit of its own in options, such as max_steps"
        )
    return asked


def _strong(state: PyTree) -> PyTree:
    """Leaves whose types are their own: what Python's numbers became would be compiled for once more."""
    return jax.tree.map(lambda leaf: jnp.asarray(leaf).astype(jnp.asarray(leaf).dtype), state)
