"""What every algorithm offers, whatever it evolves and whatever it learns by gradient."""

import dataclasses
from collections.abc import Mapping
from typing import Any, Protocol, runtime_checkable

from jaxtyping import Array, Key, PyTree

from skillcrew.envs.environment import Environment
from skillcrew.errors import UserError, unknown_name
from skillcrew.evolution.restart import LOW
from skillcrew.evolution.strategy import LOW_AVERAGE
from skillcrew.policies.team import Team
from skillcrew.whole_numbers import check_whole_numbers


@runtime_checkable
class Algorithm(Protocol):
    """`init(key) -> state`, `step(state) -> (state, metrics)`, `team(state) -> Team`; all pure.

    Seeds are a leading axis made by `jax.vmap` around all three.
    """

    name: str
    """On the command line."""
    label: str
    """In figures and tables."""
    env: Environment
    config: Any
    """A frozen dataclass; its fields are the algorithm's options."""

    def init(self, key: Key[Array, ""]) -> PyTree:
        """The state before the first generation: all that is needed to go on, keys included."""
        ...

    def step(self, state: PyTree) -> tuple[PyTree, dict[str, Array]]:
        """One generation.

        Metrics are scalars, and hold at least `environment_steps` (cumulative, added up by
        `count_steps`), `fitness_best` and `fitness_mean`.
        """
        ...

    def team(self, state: PyTree) -> Team:
        """The champion, as it stands."""
        ...

    def choices(self) -> tuple[str, ...]:
        """Names of what a team chooses among, in the order of the choice index."""
        ...

    def transient_bytes(self) -> int:
        """Estimate of the memory that `step` needs beside the state, for one seed."""
        ...


class ActsDirectly:
    """The part that all algorithms share whose teams choose nothing but give primitive actions."""

    def choices(self) -> tuple[str, ...]:
        """One name, for the index 0 that every choice is."""
        return ("primitive_action",)


def override(algorithm: Any, config: Any, overrides: Mapping[str, Any]) -> Any:
    """The configuration of an algorithm, by default its class's, with some fields changed.

    What it leaves to the environment is filled in.

    Raises:
        UserError: an unknown field, or a value that a field refuses.
    """
    fields = [field.name for field in dataclasses.fields(algorithm.config_class)]
    for field in overrides:
        if field not in fields:
            raise unknown_name(f"field of {algorithm.name}", field, fields)
    config = dataclasses.replace(config or algorithm.config_class(), **overrides)
    check_whole_numbers(config)
    return filled_in(algorithm.env, config)


def agents_differ(env: Environment) -> UserError:
    """That one actor is to be shared by agents of several types."""
    kinds = ", ".join(kind.name for kind in env.types)
    return UserError(
        f"sharing = team: agents of {env.name} differ ({kinds}), and one actor cannot be all of them; set it "
        "to agent"
    )


def filled_in(env: Environment, config: Any) -> Any:
    """A configuration in which what is left to the environment is named.

    That is how networks scale their input and, where it says what success is, below which fitness a search
    may begin anew.
    """
    changes = {}
    for field in dataclasses.fields(config):
        value = getattr(config, field.name)
        if dataclasses.is_dataclass(value):
            changes[field.name] = filled_in(env, value)
        elif field.name == "input_scaling" and value == "environment":
            changes[field.name] = env.input_scaling
        elif field.name in ("below", "restart_below") and value is None and env.success is not None:
            changes[field.name] = LOW if field.name == "below" else LOW_AVERAGE
    return dataclasses.replace(config, **changes) if changes else config
