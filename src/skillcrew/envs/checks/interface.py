"""Sizes and names, and the shapes and types of what `reset` and `step` return."""

import dataclasses
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import jax
import jax.numpy as jnp

from skillcrew.envs.checks.report import Finding
from skillcrew.envs.checks.subject import Subject
from skillcrew.envs.environment import Environment, TimeStep, TimeStepByType
from skillcrew.errors import place_of_failure

KINDS: dict[type, Any] = {float: jnp.floating, bool: jnp.bool_}


def check_attributes(subject: Subject) -> Iterator[Finding]:
    """Sizes are whole numbers, skills are names, options are a dataclass."""
    env = subject.env
    for field in ("n_agents", "observation_size", "action_size", "episode_length"):
        value = getattr(env, field, None)
        if isinstance(value, bool) or not isinstance(value, int) or value < 1:
            yield Finding("wrong", field, f"is {value!r}; set it to a whole number of at least 1")
    skills = getattr(env, "skills", None)
    if not isinstance(skills, tuple) or not all(isinstance(name, str) for name in skills):
        yield Finding("wrong", "skills", f"is {skills!r}; set it to a tuple of names")
        return
    if len(set(skills)) != len(skills):
        yield Finding("wrong", "skills", f"{skills}: a name is given twice; give each once")
    if env.config_class is not None and not dataclasses.is_dataclass(env.config_class):
        yield Finding("wrong", "config_class", "is no dataclass; decorate it with @dataclass(frozen=True)")
    yield Finding(
        "fine",
        "sizes",
        f"{env.n_agents} agent(s), {env.observation_size} numbers seen and {env.action_size} done by each, "
        f"{env.episode_length} steps; skills: {', '.join(skills) or 'none, which MADyS and MFL need'}",
    )
    yield _success(env.success)


def _success(success: Any) -> Finding:
    if success == "terminated":
        return Finding(
            "fine", "success", "is the share of episodes that end terminated; teams are scored by it"
        )
    if success is None:
        return Finding(
            "fine",
            "success",
            'is not defined, so that teams are scored by their return; set success = "terminated" if to end '
            "so is to have done the task",
        )
    return Finding("wrong", "success", f'is {success!r}; set it to "terminated", or to None')


def check_shapes(subject: Subject) -> Iterator[Finding]:
    """What `reset` and `step` return can be traced, and is of the shapes and types that it should be."""
    env, key = subject.env, subject.key
    start, finding = traced("reset", env.reset, key)
    if finding is None and not (isinstance(start, tuple) and len(start) == 2):
        finding = Finding("wrong", "reset", "returns something else; return two things, (state, observation)")
    if finding is not None:
        yield finding
        return
    state, observation = start
    yield from _of_agents(env, "reset's observation", observation, "observation_size")
    after, finding = traced("step", env.step, state, subject.still_of(), key)
    kind = TimeStepByType if env.types else TimeStep
    if finding is None and not (isinstance(after, tuple) and len(after) == 2 and isinstance(after[1], kind)):
        finding = Finding(
            "wrong", "step", f"returns something else; return (state, skillcrew.{kind.__name__}(…))"
        )
    if finding is not None:
        yield finding
        return
    moved, step = after
    yield from _of_agents(env, "step's observation", step.observation, "observation_size")
    yield from _of_agents(env, "step's local_rewards", step.local_rewards, "skills")
    for name, kind in (("team_reward", float), ("terminated", bool), ("truncated", bool)):
        yield from _of_shape(f"step's {name}", getattr(step, name), (), kind)
    yield from _same_state(state, moved)
    yield Finding("fine", "shapes", "reset and step return what they should")


def traced(name: str, function: Callable[..., Any], *arguments: Any) -> tuple[Any, Finding | None]:
    """The shapes of a function's result, or what hinders it."""
    try:
        return jax.eval_shape(function, *arguments), None
    except jax.errors.JAXTypeError as error:
        why = str(error).splitlines()[0].rstrip(".:")
        return None, Finding(
            "wrong",
            name,
            f"Python or NumPy needs the value of an array, which is not known while JAX compiles ({why}); "
            "use jnp.where or jax.lax.cond to decide, and jax.numpy throughout",
        )
    except Exception as error:
        # Whatever it is, it is the user's code that raised it.
        mend = "; keep arrays alone in the state" if isinstance(error, TypeError) else ""
        why = f"{type(error).__name__}: {str(error).splitlines()[0] if str(error) else ''}"
        return None, Finding("wrong", name, f"fails with {why} ({place_of_failure(error)}){mend}")


def _of_agents(env: Environment, what: str, value: Any, size: str) -> Iterator[Finding]:
    """A row for each agent, in an array or, where they differ, one for each type."""

    def shape(of: Any) -> tuple[int, int]:
        agents, width = getattr(of, "n_agents", None) or of.agents, getattr(of, size)
        return agents, len(width) if size == "skills" else width

    if not env.types:
        yield from _of_shape(what, value, shape(env), float)
        return
    names = [kind.name for kind in env.types]
    if not isinstance(value, Mapping) or set(value) != set(names):
        found = sorted(value) if isinstance(value, Mapping) else type(value).__name__
        yield Finding("wrong", what, f"is {found}; make it a dictionary of an array for each of {names}")
        return
    for kind in env.types:
        yield from _of_shape(f"{what}['{kind.name}']", value[kind.name], shape(kind), float)


def _of_shape(what: str, value: Any, shape: tuple[int, ...], kind: type) -> Iterator[Finding]:
    found, dtype = getattr(value, "shape", None), getattr(value, "dtype", None)
    if found != shape:
        names = {2: "a row for each agent", 0: "a single number, not one for each agent"}[len(shape)]
        yield Finding("wrong", what, f"has the shape {found}; make it {shape}: {names}")
    elif dtype is None or not jnp.issubdtype(dtype, KINDS[kind]):
        mend = ".astype(jnp.float32)" if kind is float else " a condition, such as `time >= limit`"
        yield Finding("wrong", what, f"is of type {dtype}; make it {kind.__name__}, by{mend}")


def _same_state(before: Any, after: Any) -> Iterator[Finding]:
    """A scan over time carries the state: `step` must give back what it takes."""
    if jax.tree.structure(before) != jax.tree.structure(after):
        yield Finding(
            "wrong", "state", "step returns a state of other parts than reset does; return the same in both"
        )
        return
    after_leaves = jax.tree.leaves(after)
    for (path, was), now in zip(jax.tree_util.tree_leaves_with_path(before), after_leaves, strict=True):
        if (was.shape, was.dtype) != (now.shape, now.dtype):
            place = jax.tree_util.keystr(path)
            yield Finding(
                "wrong",
                "state",
                f"state{place} is {was.dtype}{list(was.shape)} after reset and {now.dtype}{list(now.shape)} "
                "after step; make both the same",
            )
