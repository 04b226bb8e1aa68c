"""Worlds that are stepped in Python, as pure functions.

What JAX carries of a world is its seed and all actions so far; that decides everything, so that states can be
forked, mapped over, saved and stepped in any order. The host keeps worlds alive only to save replaying them.
"""

from collections.abc import Mapping
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Key, Shaped

from skillcrew.envs.agent_type import AgentType
from skillcrew.envs.bridges.host_config import HostConfig, SkillReward
from skillcrew.envs.bridges.host_pool import Pool
from skillcrew.envs.bridges.host_world import Agent, MakeWorld, by_kind
from skillcrew.envs.environment import Environment, TimeStep, TimeStepByType
from skillcrew.errors import UserError, unknown_name

State = dict[str, Array]

OWN_REWARD = "reward"
"""The skill of a world for which none are given: whatever pays the agent."""


class HostEnvironment(Environment):
    """Makes an environment of worlds on the host. The team is paid the mean of its agents' rewards.

    The key of `step` is not used: what is random in a world follows from its seed, which `reset` draws.

    Raises:
        UserError: agents of which some act by numbers and some by indices, an episode length that has to be
            given, or skills that do not fit.
    """

    def __init__(self, config: HostConfig, make: MakeWorld):
        self.config = config
        first = make()
        self.name = config.called()
        kinds = by_kind(first.agents)
        if len(ways := {agent.actions for agent in first.agents}) > 1:
            raise UserError(f"{self.name}: some agents act in Box and some in Discrete; all must act alike")
        self.actions = ways.pop()
        length = config.episode_length or first.max_steps
        if length is None:
            raise UserError(
                f"episode_length: {self.name} does not say when its episodes end; give a number of steps"
            )
        self.episode_length = length
        rewards = config.skill_rewards()
        for kind, slash, _ in (name.partition("/") for name in rewards):
            if slash and kind not in kinds:
                raise unknown_name("type of agents in skills", kind, kinds)
        self._skill_rewards = {kind: _of_kind(rewards, kind, agents[0]) for kind, agents in kinds.items()}
        self._kinds = kinds
        if len(kinds) > 1:
            self.types = tuple(
                AgentType(
                    kind,
                    len(agents),
                    agents[0].observation_size,
                    agents[0].action_size,
                    tuple(self._skill_rewards[kind]),
                )
                for kind, agents in kinds.items()
            )
        else:
            ((kind, agents),) = kinds.items()
            self.n_agents = len(agents)
            self.observation_size, self.action_size = agents[0].observation_size, agents[0].action_size
            self.skills = tuple(self._skill_rewards[kind])
        self._seen = sum(agent.observation_size for agent in first.agents)
        self._done = sum(agent.numbers for agent in first.agents)
        self._number = jnp.int32 if self.actions == "discrete" else jnp.float32
        self._pool = Pool(make, first)

    def describe(self) -> dict[str, Any]:
        return {"name": self.name, **self.config.plain()}

    def reset(self, key: Key[Array, ""]) -> tuple[State, Any]:
        # 31 bits: worlds may take their seed for a signed number.
        seed = jax.random.bits(key, dtype=jnp.uint32) >> jnp.uint32(1)
        shown = jax.ShapeDtypeStruct((self._seen,), jnp.float32)
        row = jax.pure_callback(self._reset_on_host, shown, seed, vmap_method="broadcast_all")
        state = {
            "seed": seed,
            "time": jnp.zeros((), jnp.int32),
            "digest": jnp.zeros(2, jnp.uint32),
            "actions": jnp.zeros((self.episode_length, self._done), self._number),
            "observation": row,
            "terminated": jnp.zeros((), bool),
            "truncated": jnp.zeros((), bool),
        }
        return state, self._by_type(self._observations(row))

    def step(self, state: State, action: Any, key: Key[Array, ""]) -> tuple[State, Any]:
        over = state["terminated"] | state["truncated"]
        done = self._row_of(action)
        told = (state["seed"], state["time"], state["digest"], state["actions"], over, done)
        row, rewards, ended, cut, digest = jax.pure_callback(
            self._step_on_host, self._results(), *told, vmap_method="broadcast_all"
        )
        row = jnp.where(over, state["observation"], row)
        time = state["time"] + (~over).astype(jnp.int32)
        terminated = jnp.where(over, state["terminated"], ended)
        cut = cut | (time >= self.episode_length)
        after = {
            "seed": state["seed"],
            # What is written after the end does not count: only the first `time` do.
            "time": time,
            "digest": digest,
            "actions": state["actions"].at[state["time"]].set(done),
            "observation": row,
            "terminated": terminated,
            "truncated": jnp.where(over, state["truncated"], cut & ~terminated),
        }
        return after, self._time_step(state["observation"], action, after, rewards)

    def _time_step(
        self, before: Float[Array, " numbers"], action: Any, after: State, rewards: Float[Array, " agents"]
    ) -> TimeStep | TimeStepByType:
        seen, sees = self._observations(before), self._observations(after["observation"])
        local, first = {}, 0
        for kind, agents in self._kinds.items():
            own = rewards[first : first + len(agents)]
            first += len(agents)
            does = action[kind] if self.types else action
            local[kind] = jnp.stack(
                [
                    jax.vmap(reward)(seen[kind], does, sees[kind], own).astype(jnp.float32)
                    for reward in self._skill_rewards[kind].values()
                ],
                axis=1,
            )
        return (TimeStepByType if self.types else TimeStep)(
            observation=self._by_type(sees),
            local_rewards=self._by_type(local),
            team_reward=rewards.mean(),
            terminated=after["terminated"],
            truncated=after["truncated"],
        )

    def _observations(self, row: Float[Array, " numbers"]) -> dict[str, Float[Array, "agents obs"]]:
        """What agents of each kind see, of all agents' numbers in a row."""
        seen, first = {}, 0
        for kind, agents in self._kinds.items():
            size = agents[0].observation_size
            seen[kind] = row[first : first + len(agents) * size].reshape(len(agents), size)
            first += len(agents) * size
        return seen

    def _by_type(self, of_kinds: Mapping[str, Any]) -> Any:
        return dict(of_kinds) if self.types else next(iter(of_kinds.values()))

    def _row_of(self, action: Any) -> Shaped[Array, " numbers"]:
        """All agents' actions in a row, in their order."""
        parts = [action[kind] for kind in self._kinds] if self.types else [action]
        return jnp.concatenate([part.reshape(-1).astype(self._number) for part in parts])

    def _results(self) -> tuple[jax.ShapeDtypeStruct, ...]:
        agents = sum(len(agents) for agents in self._kinds.values())
        return (
            jax.ShapeDtypeStruct((self._seen,), jnp.float32),
            jax.ShapeDtypeStruct((agents,), jnp.float32),
            jax.ShapeDtypeStruct((), jnp.bool_),
            jax.ShapeDtypeStruct((), jnp.bool_),
            jax.ShapeDtypeStruct((2,), jnp.uint32),
        )

    def _reset_on_host(self, seed: Any) -> np.ndarray:
        return self._pool.reset(np.asarray(seed))

    def _step_on_host(self, *told: Any) -> tuple[np.ndarray, ...]:
        """Results for all worlds, zeros for those that are over."""
        arrays = [np.asarray(array) for array in told]
        moved, digest = self._pool.step(*arrays)
        worlds = arrays[0].shape
        results = [np.zeros((len(moved), *of.shape), of.dtype) for of in self._results()[:-1]]
        for index, one in enumerate(moved):
            if one is not None:
                for result, value in zip(results, one, strict=True):
                    result[index] = value
        return *(result.reshape((*worlds, *result.shape[1:])) for result in results), digest


def _of_kind(rewards: Mapping[str, SkillReward], kind: str, agent: Agent) -> dict[str, SkillReward]:
    """The skills of one kind of agents: those of all, and those called "kind/skill"."""
    own = {
        name.removeprefix(f"{kind}/"): reward
        for name, reward in rewards.items()
        if "/" not in name or name.startswith(f"{kind}/")
    } or {OWN_REWARD: lambda seen, done, sees, reward: reward}
    for name, reward in own.items():
        _check_reward(name, reward, agent)
    return own


def _check_reward(name: str, reward: SkillReward, agent: Agent) -> None:
    seen = jax.ShapeDtypeStruct((agent.observation_size,), jnp.float32)
    done = (
        jax.ShapeDtypeStruct((), jnp.int32)
        if agent.actions == "discrete"
        else jax.ShapeDtypeStruct((agent.action_size,), jnp.float32)
    )
    paid = jax.ShapeDtypeStruct((), jnp.float32)
    try:
        result = jax.eval_shape(reward, seen, done, seen, paid)
    except Exception as error:
        said = str(error).splitlines()[0] if str(error) else ""
        raise UserError(
            f"skills.{name}: fails with {type(error).__name__}: {said}; it is given one agent's "
            f"(observation, action, next_observation, reward), sees "
            f"{agent.observation_size} numbers, and needs jax.numpy"
        ) from error
    if getattr(result, "shape", None) != ():
        raise UserError(f"skills.{name}: returns {result}; return one number")
