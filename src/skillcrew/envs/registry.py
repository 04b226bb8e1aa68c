"""Environments by name: those that skillcrew ships, those of installed packages, and any importable class."""

import dataclasses
import importlib.metadata
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from skillcrew.envs.importing import import_object, import_path
from skillcrew.errors import UserError, nearest_first, unknown_name

ENTRY_POINTS = "skillcrew.environments"
"""The group of entry points by which a package offers environments: name = "module:Class"."""


@dataclasses.dataclass(frozen=True)
class Domain:
    """An environment's class, and what is said of it before it is imported: importing JAX takes a second."""

    name: str
    """Of its default configuration."""
    place: str
    """`module:Class`."""
    config_class: Any
    presets: Callable[[], Mapping[str, Any]]
    shipped: bool = True


def _rover() -> Domain:
    from skillcrew.envs.rover.config import RoverConfig
    from skillcrew.envs.rover.presets import PRESETS

    return Domain("rover", "skillcrew.envs.rover.world:RoverDomain", RoverConfig, lambda: PRESETS)


def _jaxmarl() -> Domain:
    from skillcrew.envs.bridges.jaxmarl_config import JaxMARLConfig

    return Domain("jaxmarl", "skillcrew.envs.bridges.jaxmarl_in:JaxMARLEnvironment", JaxMARLConfig, dict)


SHIPPED: Mapping[str, Callable[[], Domain]] = {"rover": _rover, "jaxmarl": _jaxmarl}
"""Domains of skillcrew's own, by name."""
JAXMARL = "jaxmarl:"
"""What stands before the name of an environment of JaxMARL."""


@dataclasses.dataclass(frozen=True)
class Entry:
    """What a name stands for: a class of environments, and a configuration of it."""

    name: str
    """What the environment is called, in files and figures too."""
    place: str
    """`module:Class`."""
    config_class: Any
    """A dataclass of options, or None where there are none."""
    config: Any
    """The configuration that the name stands for, or None."""
    by_path: bool = False
    """Whether it was named by its import path, which is code, and not by a name that is registered."""

    def names_code(self) -> bool:
        """Whether making it imports what neither skillcrew nor an installed package offers."""
        return self.by_path or bool(code_of(self.config))

    def with_fields(self, fields: Mapping[str, Any]) -> "Entry":
        """The same with some fields changed.

        Raises:
            UserError: an unknown field, or a value that the configuration refuses.
        """
        known = [field.name for field in dataclasses.fields(self.config_class)] if self.config_class else []
        for field in fields:
            if not known:
                raise UserError(f"{field}: {self.name} has no options; leave it out")
            if field not in known:
                raise unknown_name(f"field of {self.name}", field, known)
        return (
            dataclasses.replace(self, config=dataclasses.replace(self.config, **fields)) if fields else self
        )

    def make(self) -> Any:
        """The environment itself.

        Raises:
            UserError: it cannot be imported or made.
        """
        kind = environment_class(self.place)
        try:
            env = kind(self.config) if self.config_class else kind()
        except UserError:
            raise
        except TypeError as error:
            raise UserError(
                f"{self.place}: cannot be made without arguments ({error}); give it a `config_class`, a "
                "frozen dataclass of its options, and take that as its one argument"
            ) from error
        env.name = self.name
        return env


def names() -> list[str]:
    """Every name that `find` knows, import paths aside; packages that cannot be imported are left out."""
    return [name for domain in domains()[0] for name in _names(domain)]


def domains() -> tuple[list[Domain], dict[str, str]]:
    """Those that skillcrew ships, then those of installed packages; and why others cannot be imported."""
    found, broken = [make() for make in SHIPPED.values()], {}
    for name, place in _entry_points():
        try:
            found.append(_of_class(name, place))
        except UserError as error:
            broken[name] = str(error)
    return found, broken


def find(name: str) -> Entry:
    """What a name stands for: a preset, a package's environment, or an import path.

    An import path is `package.module:Class` or `folder/file.py:Class`, and `…:Class/preset` for a preset of
    the class. `jaxmarl:NAME` is an environment of JaxMARL; whether there is one shows when it is made.

    Raises:
        UserError: unknown, with the valid names, nearest first; or what an import path names is not there,
            fails to be imported, or is no environment.
    """
    for make in SHIPPED.values():
        if name in _names(domain := make()):
            return _entry(domain, name)
    for entry, place in _entry_points():
        if entry == name:
            return _entry(_of_class(entry, place), name)
    if name.startswith(JAXMARL):
        return _of_jaxmarl(name.removeprefix(JAXMARL))
    if ":" in name:
        return _of_path(name)
    offered, broken = domains()
    for domain in offered:
        if name in _names(domain):
            return _entry(domain, name)
    valid = [other for domain in offered for other in _names(domain)]
    not_loaded = "".join(f"; {entry} fails to load: {why}" for entry, why in broken.items())
    near = ", ".join(nearest_first(name, valid))
    raise UserError(
        f"unknown environment '{name}'; valid, nearest first: {near}; or an import path, such as "
        f"mylab.rescue:Rescue, or {JAXMARL}NAME{not_loaded}"
    )


def make(name: str, **overrides: Any) -> Any:
    """Makes an environment by its name, with any field overridden.

    Args:
        name: a preset, such as "rover-t2-c2", an environment of an installed package, or an import path,
            such as "mylab.rescue:Rescue", or one of JaxMARL, such as "jaxmarl:MPE_simple_spread_v3".
        overrides: fields of its configuration, such as `n_agents=4`.

    Raises:
        UserError: an unknown name or field, or a value that the field refuses.
    """
    return find(name).with_fields(overrides).make()


def place_of(env: Any) -> str | None:
    """The import path of an environment's class, or None where its name alone says which class it is."""
    place = import_path(type(env))
    try:
        registered = find(env.name) if ":" not in env.name else None
    except UserError:
        registered = None
    return None if registered is not None and registered.place == place else place


def is_offered(place: str) -> bool:
    """Whether skillcrew or an installed package offers this class."""
    shipped = (make().place for make in SHIPPED.values())
    return place in (*shipped, *(offered for _, offered in _entry_points()))


def code_of(config: Any) -> Mapping[str, str]:
    """Import paths of code that a configuration names, such as functions for skills, by where it does."""
    return config.code() if hasattr(config, "code") else {}


def environment_class(place: str) -> Any:
    """Imports a class of environments.

    Raises:
        UserError: it is not there, fails to be imported, or is no environment.
    """
    from skillcrew.envs.environment import Environment

    kind = import_object(place, here=not is_offered(place))
    if isinstance(kind, type) and issubclass(kind, Environment):
        return kind
    what = "a class" if isinstance(kind, type) else f"{type(kind).__name__}"
    raise UserError(f"{place}: {what}, and no subclass of skillcrew.Environment")


def _of_path(path: str) -> Entry:
    module, _, inner = path.partition(":")
    class_name, _, preset = inner.partition("/")
    place = f"{module}:{class_name}"
    name = environment_class(place).name
    domain = _of_class(name, place)
    if preset:
        presets = domain.presets()
        if preset not in presets:
            raise unknown_name(f"preset of {place}", preset, presets)
        called = preset if preset.startswith(name) else f"{name}-{preset}"
        return Entry(called, place, domain.config_class, presets[preset], by_path=True)
    return dataclasses.replace(_entry(domain, name), by_path=True)


def _of_jaxmarl(env_id: str) -> Entry:
    from skillcrew.envs.bridges.jaxmarl_config import JaxMARLConfig, file_name

    domain = _jaxmarl()
    return Entry(file_name(env_id), domain.place, domain.config_class, JaxMARLConfig(env_id))


def _of_class(name: str, place: str) -> Domain:
    kind = environment_class(place)
    return Domain(name, place, kind.config_class, lambda: kind.presets, shipped=False)


def _names(domain: Domain) -> list[str]:
    presets = list(domain.presets())
    return presets if domain.shipped else [domain.name, *presets]


def _entry(domain: Domain, name: str) -> Entry:
    config = domain.presets().get(name)
    if config is None and domain.config_class:
        config = domain.config_class()
    return Entry(name, domain.place, domain.config_class, config)


def _entry_points() -> Iterator[tuple[str, str]]:
    for entry in importlib.metadata.entry_points(group=ENTRY_POINTS):
        yield entry.name, entry.value
