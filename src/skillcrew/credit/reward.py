"""The one number of each transition that a learner maximises."""

import numpy as np
from jaxtyping import Array, Float

from skillcrew.credit.difference import CREDITS
from skillcrew.envs.environment import Environment
from skillcrew.errors import UserError, unknown_name


class LearnedReward:
    """A reward by its name: the team's, local ones summed up, or an agent's part of the team's.

    Raises:
        UserError: a reward that the environment lacks.
    """

    def __init__(self, env: Environment, name: str):
        self._summed = _summed(env, name)

    def __call__(
        self, local_rewards: Float[Array, "*batch skills"], team_reward: Float[Array, "*batch"]
    ) -> Float[Array, "*batch"]:
        """Of each transition of one agent."""
        if self._summed is None:
            return team_reward
        return local_rewards[..., self._summed].sum(-1)


def _summed(env: Environment, reward: str) -> np.ndarray | None:
    """Where the local rewards that make up a reward stand; None for the team's reward."""
    if reward == "team":
        return None
    if reward in CREDITS:
        if reward not in env.skills:
            raise UserError(
                f"reward = {reward}: credits each agent for its part of the team's reward, which td3, ddpg, "
                "dqn, maddpg, matd3, ippo, mappo, coma and liir learn from; use one of these, or another"
            )
        return np.array([env.skills.index(reward)])
    if not env.skills and reward in ("local", "first"):
        raise UserError(
            f"reward = {reward}: {env.name} has no skills, and so no local rewards; give it some, or set "
            "reward to team in an algorithm that learns from it: erl, cerl, td3, maddpg, mappo"
        )
    if reward == "local":
        return np.arange(len(env.skills))
    names = reward.split("+")
    for name in names:
        if name not in env.skills:
            raise unknown_name("reward", name, ("team", "local", *CREDITS, *env.skills))
    return np.array([env.skills.index(name) for name in names])
