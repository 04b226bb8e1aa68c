"""Environments by name: those that skillcrew ships, those of installed packages, and any importable class."""

import dataclasses
import importlib.metadata
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from skillcrew.envs.bridges.names import BRIDGES, Bridge
from skillcrew.envs.importing import import_object, import_path
from skillcrew.errors import UserError, nearest_first, unknown_name
from skillcrew.whole_numbers import check_whole_numbers

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


def _rescue() -> Domain:
    from skillcrew.envs.rescue.config import RescueConfig
    from skillcrew.envs.rescue.presets import PRESETS

    return Domain("rescue", "skillcrew.envs.rescue.world:RescueDomain", RescueConfig, lambda: PRESETS)


def _warehouse() -> Domain:
    from skillcrew.envs.warehouse.config import WarehouseConfig
    from skillcrew.envs.warehouse.presets import PRESETS

    place = "skillcrew.envs.warehouse.world:WarehouseDomain"
    return Domain("warehouse", place, WarehouseConfig, lambda: PRESETS)


SHIPPED: Mapping[str, Callable[[], Domain]] = {"rover": _rover, "rescue": _rescue, "warehouse": _warehouse}
"""Domains of skillcrew's own, by name."""


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

    @property
    def is_foreign(self) -> bool:
        """Whether making it runs code that no installed package offers, which its user named."""
        return self.by_path or foreign_code(self.config) is not None

    def make(self) -> Any:
        """The environment itself.

        Raises:
            UserError: it cannot be imported or made.
        """
        if self.config_class:
            check_whole_numbers(self.config)
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
    return [name for domain in domains()[0] for name in names_of(domain)]


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
    """What a name stands for: a preset, a package's environment, another library's, or an import path.

    An import path is `package.module:Class` or `folder/file.py:Class`, and `…:Class/preset` for a preset of
    the class.

    Raises:
        UserError: unknown, with the valid names, nearest first; or what an import path names is not there,
            fails to be imported, or is no environment.
    """
    prefix, colon, rest = name.partition(":")
    if colon and prefix in BRIDGES:
        return _bridged(BRIDGES[prefix], rest)
    for make in SHIPPED.values():
        if name in names_of(domain := make()):
            return _entry(domain, name)
    for entry, place in _entry_points():
        if entry == name:
            return _entry(_of_class(entry, place), name)
    if ":" in name:
        return _of_path(name)
    offered, broken = domains()
    for domain in offered:
        if name in names_of(domain):
            return _entry(domain, name)
    valid = [other for domain in offered for other in names_of(domain)]
    not_loaded = "".join(f"; {entry} fails to load: {why}" for entry, why in broken.items())
    near = ", ".join(nearest_first(name, valid))
    raise UserError(
        f"unknown environment '{name}'; valid, nearest first: {near}; or an import path, such as "
        f"mylab.rescue:Rescue{not_loaded}"
    )


def make(name: str, **overrides: Any) -> Any:
    """Makes an environment by its name, with any field overridden.

    Args:
        name: a preset, such as "rover-t2-c2", an environment of an installed package, an import path, such
            as "mylab.rescue:Rescue", or another library's, such as "gymnasium:Pendulum-v1".
        overrides: fields of its configuration, such as `n_agents=4`.

    Raises:
        UserError: an unknown name or field, or a value that the field refuses.
    """
    return find(name).with_fields(overrides).make()


def place_of(env: Any) -> str | None:
    """The import path of an environment's class, or None for a preset of one that skillcrew ships.

    The names that a package gives its own are gone where it is not installed.
    """
    place = import_path(type(env))
    shipped = (make() for make in SHIPPED.values())
    return None if any(place == one.place and env.name in names_of(one) for one in shipped) else place


def is_offered(place: str) -> bool:
    """Whether skillcrew or an installed package offers this class."""
    shipped = (make().place for make in SHIPPED.values())
    bridges = (bridge.place for bridge in BRIDGES.values())
    return place in (*shipped, *bridges, *(offered for _, offered in _entry_points()))


def environment_class(place: str) -> Any:
    """Imports a class of environments.

    Raises:
        UserError: it is not there, fails to be imported, or is no environment.
    """
    from skillcrew.envs.environment import Environment

    kind = import_object(place, here=not is_offered(place))
    if kind is Environment:
        raise UserError(
            f"{place}: what environments are derived from, and none itself; give a class of yours"
        )
    if isinstance(kind, type) and issubclass(kind, Environment):
        return kind
    what = "a class" if isinstance(kind, type) else f"{type(kind).__name__}"
    raise UserError(f"{place}: {what}, and no subclass of skillcrew.Environment")


def foreign_code(config: Any) -> str | None:
    """The field of a configuration that makes code run which no installed package offers, if there is one."""
    return config.foreign_code() if hasattr(config, "foreign_code") else None


def _bridged(bridge: Bridge, name: str) -> Entry:
    config = bridge.configure(name)
    return Entry(config.called(), bridge.place, type(config), config)


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


def _of_class(name: str, place: str) -> Domain:
    kind = environment_class(place)
    return Domain(name, place, kind.config_class, lambda: kind.presets, shipped=False)


def names_of(domain: Domain) -> list[str]:
    """What its configurations are called, of a package also the environment itself."""
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
