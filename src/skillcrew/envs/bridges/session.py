"""An environment as other libraries step it: one world that remembers where it is."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Key, UInt8

from skillcrew.envs.agent_type import AgentType
from skillcrew.envs.environment import Environment
from skillcrew.envs.offers import OffersScene, require
from skillcrew.errors import UserError, unknown_name


class Seat(NamedTuple):
    """Where an agent's numbers are."""

    kind: AgentType
    index: int
    """Within its type."""


class Moment(NamedTuple):
    """What a step brings, by agent."""

    observations: dict[str, np.ndarray]
    rewards: dict[str, float]
    terminated: bool
    truncated: bool


class Session:
    """Plays one world of an environment.

    Agents are called after their type and number, such as "agent_0". One that is neither terminated nor
    truncated after `episode_length` steps is truncated there.

    Args:
        rewards: names of `env.skills`, whose local rewards an agent is paid the sum of; None pays every
            agent the team's reward.
        render_mode: "rgb_array" for pictures.

    Raises:
        UserError: an unknown name, or no scene to draw pictures of.
    """

    def __init__(self, env: Environment, rewards: Sequence[str] | None, render_mode: str | None):
        self.env = env
        types = env.types or (
            AgentType("agent", env.n_agents, env.observation_size, env.action_size, env.skills),
        )
        self.seats = {
            f"{kind.name}_{index}": Seat(kind, index) for kind in types for index in range(kind.agents)
        }
        for name in rewards or ():
            if name not in env.skills:
                raise unknown_name(f"skill of {env.name}", name, env.skills)
        self._paid = None if rewards is None else self._columns(tuple(rewards))
        if render_mode not in (None, "rgb_array"):
            raise UserError(f"render_mode = {render_mode!r}: give 'rgb_array' or None")
        self._scenery = None if render_mode is None else require(env, OffersScene, "render_mode='rgb_array'")
        self._reset, self._step = jax.jit(env.reset), jax.jit(env.step)
        self._key = _key_of(None)
        self._state: Any = None
        self._time = 0

    def reset(self, seed: int | None) -> dict[str, np.ndarray]:
        """A new world; without a seed the one that follows, or any at first."""
        if seed is not None:
            self._key = _key_of(seed)
        self._key, key = jax.random.split(self._key)
        self._state, observation = self._reset(key)
        self._time = 0
        return self._observed(observation)

    def step(self, actions: Mapping[str, Any]) -> Moment:
        """Moves every agent.

        Raises:
            UserError: before `reset`, or an action that is missing or does not fit.
        """
        state = self.state("step")
        self._key, key = jax.random.split(self._key)
        self._state, step = self._step(state, self._joined(actions), key)
        self._time += 1
        terminated = bool(step.terminated)
        is_late = bool(step.truncated) or self._time >= self.env.episode_length
        rewards = self._rewards(step)
        return Moment(self._observed(step.observation), rewards, terminated, is_late and not terminated)

    def picture(self) -> UInt8[np.ndarray, "height width 3"] | None:
        """Of the present moment; None without a render mode.

        Raises:
            UserError: before `reset`.
        """
        if self._scenery is None:
            return None
        state = self.state("render")
        # Importing matplotlib takes half a second, which whoever draws nothing need not wait for.
        from skillcrew.envs.bridges.picture import picture

        return picture(self._scenery.scene(state))

    def state(self, needed_by: str) -> Any:
        """What `reset` and `step` of the environment pass on.

        Raises:
            UserError: before `reset`; the line names who needs it.
        """
        if self._state is None:
            raise UserError(f"{self.env.name}: call reset before {needed_by}")
        return self._state

    def _columns(self, names: tuple[str, ...]) -> dict[str, list[int]]:
        """Which of its local rewards each agent is paid."""
        return {
            agent: [
                column
                for column, skill in enumerate(seat.kind.skills)
                if (f"{seat.kind.name}/{skill}" if self.env.types else skill) in names
            ]
            for agent, seat in self.seats.items()
        }

    def _of(self, arrays: Any, seat: Seat) -> Any:
        """An agent's part of what there is for all."""
        return (arrays[seat.kind.name] if self.env.types else arrays)[seat.index]

    def _observed(self, observation: Any) -> dict[str, np.ndarray]:
        seen = jax.tree.map(lambda array: np.array(array, np.float32), observation)
        return {agent: self._of(seen, seat) for agent, seat in self.seats.items()}

    def _rewards(self, step: Any) -> dict[str, float]:
        if self._paid is None:
            return dict.fromkeys(self.seats, float(step.team_reward))
        local = jax.tree.map(np.asarray, step.local_rewards)
        return {
            agent: float(self._of(local, seat)[self._paid[agent]].sum()) for agent, seat in self.seats.items()
        }

    def _joined(self, actions: Mapping[str, Any]) -> Any:
        rows: dict[str, list[Any]] = {}
        for agent, seat in self.seats.items():
            if agent not in actions:
                raise UserError(f"no action for {agent}; give one for each of {', '.join(self.seats)}")
            rows.setdefault(seat.kind.name, []).append(self._checked(agent, seat.kind, actions[agent]))
        kind = jnp.int32 if self.env.actions == "discrete" else jnp.float32
        arrays = {name: jnp.asarray(np.stack(row), kind) for name, row in rows.items()}
        return arrays if self.env.types else arrays[next(iter(arrays))]

    def _checked(self, agent: str, kind: AgentType, action: Any) -> np.ndarray:
        given = np.asarray(action)
        if self.env.actions == "discrete":
            if given.size != 1 or not 0 <= int(given.reshape(())) < kind.action_size:
                raise UserError(
                    f"action of {agent} = {action}: give an index from 0 to {kind.action_size - 1}"
                )
            return given.reshape(())
        if given.shape != (kind.action_size,):
            raise UserError(f"action of {agent} has the shape {given.shape}; make it ({kind.action_size},)")
        return np.clip(given, -1.0, 1.0)


def _key_of(seed: int | None) -> Key[Array, ""]:
    """Of a seed of any size; without one, of chance."""
    return jax.random.key(jnp.uint32(np.random.SeedSequence(seed).generate_state(1)[0]))
