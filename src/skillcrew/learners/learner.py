"""The learner that suits the actions: TD3 for continuous ones, DQN for discrete ones."""

from skillcrew.learners.dqn import DQN, DQNConfig, DQNState
from skillcrew.learners.td3 import TD3, TD3Config, TD3State

Learner = TD3 | DQN
LearnerState = TD3State | DQNState


def make_learner(
    td3: TD3Config,
    dqn: DQNConfig,
    observation_size: int,
    action_size: int,
    choices: int,
    heads: int = 0,
) -> Learner:
    """A learner for one policy.

    Args:
        choices: discrete actions that each decision is made among; 0 for continuous actions.
        heads: agents of which each has a last layer of its own.
    """
    if choices:
        return DQN(dqn, observation_size, action_size, heads, action_size // choices)
    return TD3(td3, observation_size, action_size, heads)


def unused_learner(choices: int) -> str:
    """The name of the configurations' section that `make_learner` does not look at."""
    return "learner" if choices else "dqn"
