"""Agents that differ: what those of one type see, do and can learn."""

import dataclasses

from skillcrew.errors import UserError


@dataclasses.dataclass(frozen=True)
class AgentType:
    """Some agents of a team that are alike; see `Environment.types`.

    Raises:
        UserError: a size below 1, or skills that are not distinct names.
    """

    name: str
    """What the dictionaries of `reset` and `step` call it."""
    agents: int
    """How many there are."""
    observation_size: int
    action_size: int
    """Numbers per action; with discrete actions, how many there are."""
    skills: tuple[str, ...] = ()
    """What agents of this type can learn, in the order of their local rewards' last axis."""

    def __post_init__(self) -> None:
        for field in ("agents", "observation_size", "action_size"):
            value = getattr(self, field)
            if isinstance(value, bool) or not isinstance(value, int) or value < 1:
                raise UserError(f"agent type {self.name}: {field} = {value!r}; give a number of at least 1")
        if len(set(self.skills)) != len(self.skills):
            raise UserError(f"agent type {self.name}: skills = {self.skills}; give each name once")
