"""The way from our environments to JaxMARL."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from skillcrew.envs.bridges.jaxmarl_package import import_jaxmarl
from skillcrew.envs.environment import Environment

if TYPE_CHECKING:
    from skillcrew.envs.bridges.jaxmarl_out import TeamEnv


def jaxmarl_env(env: Environment, skills: Sequence[str] = ()) -> "TeamEnv":
    """An environment for what is written for JaxMARL: its wrappers, its baselines.

    Args:
        skills: names of `env.skills`. Each agent is then paid the sum of its local rewards for these,
            dense and its own; without, every agent is paid the team's reward.

    Raises:
        UserError: JaxMARL is not installed, or the environment has no such skill.
    """
    import_jaxmarl()
    from skillcrew.envs.bridges.jaxmarl_out import TeamEnv

    return TeamEnv(env, skills)
