"""Gymnasium's spaces, which are PettingZoo's too, and the numbers that networks see and say."""

from typing import Any, Literal

import gymnasium
import numpy as np
from gymnasium.spaces import Box, Discrete
from jaxtyping import Float

from skillcrew.envs.agent_type import AgentType
from skillcrew.envs.bridges.host_world import Agent
from skillcrew.errors import UserError


def agent(name: str, observation: gymnasium.Space, action: gymnasium.Space) -> Agent:
    """What an agent of these spaces sees and does.

    Raises:
        UserError: spaces that do not fit.
    """
    return Agent(name, _observation_size(name, observation), *_action_size(name, action))


def flat(space: gymnasium.Space, observation: Any) -> Float[np.ndarray, " numbers"]:
    """An observation in a row; of a discrete one, a 1 at its place."""
    if isinstance(space, Discrete):
        return np.eye(int(space.n), dtype=np.float32)[int(observation) - int(space.start)]
    return np.asarray(observation, np.float32).reshape(-1)


def native(space: gymnasium.Space, numbers: np.ndarray) -> Any:
    """The action that numbers in [-1, 1], or an index, stand for: -1 is the lower bound, 1 the upper one."""
    if isinstance(space, Discrete):
        return np.int64(int(numbers[0]) + int(space.start))
    assert isinstance(space, Box)
    share = (np.clip(numbers, -1.0, 1.0).reshape(space.shape) + 1) / 2
    return (space.low + share * (space.high - space.low)).astype(space.dtype)


def _observation_size(name: str, space: gymnasium.Space) -> int:
    if isinstance(space, Discrete):
        return int(space.n)
    if isinstance(space, Box) and (size := int(np.prod(space.shape))) > 0:
        return size
    raise UserError(
        f"{name} observes {_one_line(space)}; only Box, which is flattened, and Discrete are seen"
    )


def _action_size(name: str, space: gymnasium.Space) -> tuple[int, Any]:
    if isinstance(space, Discrete):
        return int(space.n), "discrete"
    if not (isinstance(space, Box) and np.issubdtype(space.dtype, np.floating) and np.prod(space.shape) > 0):
        raise UserError(f"{name} acts in {_one_line(space)}; only Box of floats and Discrete can be acted in")
    if not (np.isfinite(space.low).all() and np.isfinite(space.high).all()):
        raise UserError(
            f"{name} acts in {_one_line(space)}, which has no bounds to scale [-1, 1] to; wrap the "
            "world so that it has some"
        )
    return int(np.prod(space.shape)), "continuous"


def _one_line(space: gymnasium.Space) -> str:
    return " ".join(str(space).split())


def observation_space(kind: AgentType) -> Box:
    """What agents of a type see."""
    return Box(-np.inf, np.inf, (kind.observation_size,), np.float32)


def action_space(kind: AgentType, actions: Literal["continuous", "discrete"]) -> Box | Discrete:
    """What agents of a type do."""
    if actions == "discrete":
        return Discrete(kind.action_size)
    return Box(-1.0, 1.0, (kind.action_size,), np.float32)
