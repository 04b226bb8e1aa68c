"""JaxMARL itself: imported where it is needed, and asked for an environment."""

import contextlib
import inspect
import io
import sys
from collections.abc import Generator, Mapping
from types import ModuleType
from typing import Any

from skillcrew.errors import UserError, unknown_name

MPE_OPTIONS = ("damping", "contact_force", "contact_margin")
"""What JaxMARL's MPE takes beside the arguments in its signatures; others it drops without a word."""
UNLIMITED = 2**30
"""More steps than any episode has."""


def import_jaxmarl() -> ModuleType:
    """The package.

    Raises:
        UserError: it is not installed, or what it needs is not.
    """
    try:
        with _quiet():
            import jaxmarl
    except ImportError as error:
        raise UserError(
            f"JaxMARL cannot be imported ({error}); install it: pip install 'skillcrew[interop]'"
        ) from error
    return jaxmarl


@contextlib.contextmanager
def _quiet() -> Generator[None]:
    """Drops what importing JaxMARL prints, which would spoil the JSON of commands that print nothing else.

    It also sets standard output and error back to those that the process began with.
    """
    names = ("stdout", "stderr", "__stdout__", "__stderr__")
    kept = {name: getattr(sys, name) for name in names}
    sys.stdout = sys.__stdout__ = io.StringIO()  # ty: ignore[invalid-assignment]
    try:
        yield
    finally:
        for name, stream in kept.items():
            setattr(sys, name, stream)


def make_world(env_id: str, options: Mapping[str, Any]) -> Any:
    """An environment of JaxMARL.

    Raises:
        UserError: an unknown name or option, or JaxMARL cannot make it.
    """
    jaxmarl = import_jaxmarl()
    if env_id not in jaxmarl.registered_envs:
        raise unknown_name("environment of JaxMARL", env_id, jaxmarl.registered_envs)
    try:
        world = jaxmarl.make(env_id, **_resolved(env_id, options))
    except UserError:
        raise
    except Exception as error:
        # Whatever it is, the name and the options led there.
        said = (str(error).splitlines() or [""])[0]
        given = f" with options {dict(options)}" if options else ""
        raise UserError(f"JaxMARL cannot make {env_id}{given}: {type(error).__name__}: {said}") from error
    _refuse_dropped(world, env_id, options)
    return world


def own_limit(world: Any) -> int | None:
    """Steps after which an environment of JaxMARL ends by itself, where it says so."""
    if hasattr(world, "max_steps"):
        return int(world.max_steps)
    if hasattr(world, "num_inner_steps") and hasattr(world, "num_outer_steps"):
        return int(world.num_inner_steps) * int(world.num_outer_steps)
    return None


def reaches_limit(world: Any, steps: int) -> bool:
    """Whether an episode of so many steps may end for the environment's own limit, and not by its task."""
    from jaxmarl.environments import SimpleMPE

    limit = own_limit(world)
    # MPE looks at the clock before it moves on, and ends one step late.
    return limit is not None and steps >= limit + isinstance(world, SimpleMPE)


def without_limit(world: Any) -> Any | None:
    """The same environment with no limit in its way, or None where none can be lifted.

    Its `done` says whether the task is over, which JaxMARL does not tell from running out of time. All
    else is that of the environment, unless it shows agents the time that is left.
    """
    held = vars(world)
    if "max_steps" in held:
        changes = {"max_steps": UNLIMITED}
    elif "_env" in held and (inner := without_limit(held["_env"])) is not None:
        changes = {"_env": inner}
    else:
        return None
    # Not by `copy`, which wrappers that hand on every attribute send into a loop.
    twin = object.__new__(type(world))
    vars(twin).update({**held, **changes})
    return twin


def _resolved(env_id: str, options: Mapping[str, Any]) -> dict[str, Any]:
    """Arguments of `jaxmarl.make`: those that are objects, by their names in JaxMARL's own tables."""
    from jaxmarl.environments.overcooked import overcooked_layouts
    from jaxmarl.environments.smax.smax_env import MAP_NAME_TO_SCENARIO

    tables = {"layout": overcooked_layouts} if env_id == "overcooked" else {"scenario": MAP_NAME_TO_SCENARIO}
    resolved = dict(options)
    for field in tables.keys() & options.keys():
        name = options[field]
        if name not in tables[field]:
            raise unknown_name(f"{field} of {env_id}", str(name), tables[field])
        resolved[field] = tables[field][name]
    return resolved


def _refuse_dropped(world: Any, env_id: str, options: Mapping[str, Any]) -> None:
    from jaxmarl.environments import SimpleMPE

    if not isinstance(world, SimpleMPE):
        return
    known = {*MPE_OPTIONS}
    for kind in type(world).__mro__:
        if kind is not object:
            known |= set(inspect.signature(vars(kind).get("__init__", kind.__init__)).parameters)
    for name in options:
        if name not in known:
            raise unknown_name(f"option of {env_id}", name, sorted(known - {"self", "kwargs"}))
