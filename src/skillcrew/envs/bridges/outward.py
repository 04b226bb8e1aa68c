"""Environments of ours for programs that are written for PettingZoo or Gymnasium."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from skillcrew.envs.bridges.interop import needed
from skillcrew.envs.environment import Environment
from skillcrew.errors import UserError

if TYPE_CHECKING:
    from skillcrew.envs.bridges.gymnasium_single import SingleAgentEnv
    from skillcrew.envs.bridges.pettingzoo_parallel import TeamEnv


def pettingzoo_env(
    env: Environment, rewards: Sequence[str] | None = None, render_mode: str | None = None
) -> "TeamEnv":
    """An environment as a PettingZoo `ParallelEnv`, with agents called "agent_0", …, or "type_0", ….

    Args:
        rewards: names of `env.skills`: each agent is paid the sum of its local rewards of these. None: each
            is paid the team's reward.
        render_mode: "rgb_array" has `render` return a picture of the environment's `scene`.

    Raises:
        UserError: PettingZoo is not installed, an unknown skill, or no scene to draw.
    """
    needed("pettingzoo")
    from skillcrew.envs.bridges.pettingzoo_parallel import TeamEnv

    return TeamEnv(env, rewards, render_mode)


def gymnasium_env(
    env: Environment, rewards: Sequence[str] | None = None, render_mode: str | None = None
) -> "SingleAgentEnv":
    """An environment with a single agent as a Gymnasium `Env`.

    Args:
        rewards: as for `pettingzoo_env`.
        render_mode: likewise.

    Raises:
        UserError: Gymnasium is not installed, more than one agent, an unknown skill, or no scene to draw.
    """
    needed("gymnasium")
    if env.n_agents > 1:
        raise UserError(
            f"{env.name} has {env.n_agents} agents and Gymnasium knows one; use skillcrew.pettingzoo_env"
        )
    from skillcrew.envs.bridges.gymnasium_single import SingleAgentEnv

    return SingleAgentEnv(env, rewards, render_mode)
