"""Our environments behind JaxMARL's `MultiAgentEnv`. Needs JaxMARL; `to_jaxmarl.jaxmarl_env` asks for it."""

import functools
from collections.abc import Mapping, Sequence
from typing import Any

import jax
import jax.numpy as jnp
from flax import struct
from jaxmarl.environments import MultiAgentEnv
from jaxmarl.environments import State as JaxMARLState
from jaxmarl.environments.spaces import Box, Discrete, Space
from jaxtyping import Array, Bool, Float, Key

from skillcrew.envs.agent_type import AgentType
from skillcrew.envs.environment import Environment
from skillcrew.errors import UserError, unknown_name

ONLY_TYPE = "agent"
"""What agents are called where all are alike."""


@struct.dataclass
class TeamState(JaxMARLState):
    """A world of ours, with what its agents see, which JaxMARL asks for by the state."""

    # JaxMARL annotates these two as of one world, but `vmap` makes states of many.
    done: Any
    step: Any
    world: Any
    observation: Any


class TeamEnv(MultiAgentEnv):
    """One of our environments as JaxMARL has them: dictionaries by agent, and `step` resets when it is over.

    Agents are called `agent_0`, `agent_1` and so on, or by their type. `info` has for every agent the team's
    reward and whether the task is over, which `done` does not tell from running out of time.
    """

    def __init__(self, env: Environment, skills: Sequence[str] = ()):
        """See `to_jaxmarl.jaxmarl_env`."""
        self.env = env
        kinds = env.types or (
            AgentType(ONLY_TYPE, env.n_agents, env.observation_size, env.action_size, env.skills),
        )
        self._agents = {kind.name: [f"{kind.name}_{index}" for index in range(kind.agents)] for kind in kinds}
        self._columns = _columns(env, kinds, skills)
        self._dense = bool(skills)
        super().__init__(env.n_agents)
        self.agents = [agent for agents in self._agents.values() for agent in agents]
        self.max_steps = env.episode_length
        self._kind_of = {agent: kind for kind in kinds for agent in self._agents[kind.name]}
        self.observation_spaces = {
            agent: Box(-jnp.inf, jnp.inf, (kind.observation_size,)) for agent, kind in self._kind_of.items()
        }
        self.action_spaces = {agent: self._action_space(kind) for agent, kind in self._kind_of.items()}

    @property
    def name(self) -> str:
        return self.env.name

    @property
    def agent_classes(self) -> dict[str, list[str]]:
        return self._agents

    @functools.partial(jax.jit, static_argnums=0)
    def reset(self, key: Key[Array, ""]) -> tuple[dict[str, Array], TeamState]:
        world, observation = self.env.reset(key)
        state = TeamState(jnp.zeros((), bool), jnp.zeros((), jnp.int32), world, observation)
        return self.get_obs(state), state

    @functools.partial(jax.jit, static_argnums=0)
    def step_env(
        self, key: Key[Array, ""], state: TeamState, actions: Mapping[str, Array]
    ) -> tuple[
        dict[str, Array],
        TeamState,
        dict[str, Array],
        dict[str, Bool[Array, ""]],
        dict[str, Float[Array, "..."]],
    ]:
        """One step, with no reset after it."""
        action = {
            kind: jnp.stack([actions[agent] for agent in agents]) for kind, agents in self._agents.items()
        }
        world, step = self.env.step(state.world, action if self.env.types else action[ONLY_TYPE], key)
        done = step.terminated | step.truncated
        state = TeamState(done, state.step + 1, world, step.observation)
        dones = {agent: done for agent in [*self.agents, "__all__"]}
        info = {
            "team_reward": jnp.full(self.num_agents, step.team_reward),
            "terminated": jnp.full(self.num_agents, step.terminated),
        }
        return self.get_obs(state), state, self._rewards(step), dones, info

    def get_obs(self, state: Any) -> dict[str, Array]:
        return self._by_agent(state.observation)

    @functools.partial(jax.jit, static_argnums=0)
    def get_avail_actions(self, state: TeamState) -> dict[str, Array]:
        """All actions, always."""
        return {agent: jnp.ones(kind.action_size, bool) for agent, kind in self._kind_of.items()}

    def _action_space(self, kind: AgentType) -> Space:
        if self.env.actions == "discrete":
            return Discrete(kind.action_size)
        return Box(-1.0, 1.0, (kind.action_size,))

    def _rewards(self, step: Any) -> dict[str, Float[Array, ""]]:
        if not self._dense:
            return {agent: step.team_reward for agent in self.agents}
        local = step.local_rewards if self.env.types else {ONLY_TYPE: step.local_rewards}
        summed = {kind: local[kind][:, self._columns[kind]].sum(-1) for kind in self._agents}
        return self._by_agent(summed if self.env.types else summed[ONLY_TYPE])

    def _by_agent(self, values: Any) -> dict[str, Array]:
        by_type = values if self.env.types else {ONLY_TYPE: values}
        return {
            agent: by_type[kind][index]
            for kind, agents in self._agents.items()
            for index, agent in enumerate(agents)
        }


def _columns(
    env: Environment, kinds: Sequence[AgentType], skills: Sequence[str]
) -> dict[str, tuple[int, ...]]:
    """Which of each type's local rewards are summed."""
    if isinstance(skills, str):
        raise UserError(f"skills = {skills!r}: give a list of names")
    for name in skills:
        if name not in env.skills:
            raise unknown_name(f"skill of {env.name}", name, env.skills)
    chosen = set(skills)
    return {
        kind.name: tuple(
            index
            for index, skill in enumerate(kind.skills)
            if (f"{kind.name}/{skill}" if env.types else skill) in chosen
        )
        for kind in kinds
    }
