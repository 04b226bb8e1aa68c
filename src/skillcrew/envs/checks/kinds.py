"""Kinds of actions, and types of agents."""

from collections.abc import Iterator

from skillcrew.envs.agent_type import AgentType
from skillcrew.envs.checks.report import Finding
from skillcrew.envs.checks.subject import Subject
from skillcrew.envs.environment import FROM_TYPES


def check_kinds(subject: Subject) -> Iterator[Finding]:
    """Actions are continuous or discrete; types are types, each with a name of its own."""
    env = subject.env
    if env.actions not in ("continuous", "discrete"):
        yield Finding("wrong", "actions", f'is {env.actions!r}; set it to "continuous" or "discrete"')
        return
    if env.actions == "discrete":
        if env.action_size < 2:
            yield Finding("wrong", "action_size", "is 1, and leaves nothing to pick; give at least 2")
            return
        yield Finding("fine", "actions", f"each agent picks one of {env.action_size}")
    types = env.types
    if not isinstance(types, tuple) or not all(isinstance(kind, AgentType) for kind in types):
        yield Finding("wrong", "types", f"is {types!r}; set it to a tuple of skillcrew.AgentType")
        return
    names = [kind.name for kind in types]
    if len(set(names)) != len(names):
        yield Finding("wrong", "types", f"{names}: a name is given twice; give each once")
    for field, derive in FROM_TYPES.items():
        if types and (given := getattr(env, field)) != (derived := derive(types)):
            yield Finding("wrong", field, f"is {given!r}, and of the types {derived!r}; leave it out")
    for kind in types:
        yield Finding(
            "fine",
            f"type {kind.name}",
            f"{kind.agents} agent(s), {kind.observation_size} numbers seen, {kind.action_size} done by each; "
            f"skills: {', '.join(kind.skills) or 'none'}",
        )
