"""Which types come before which, and which of them at once: what a configuration says, checked."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from skillcrew.errors import UserError, unknown_name

Group = tuple[str, ...]
"""Types that are observed in the same step; most are by themselves."""
Graph = Mapping[str, tuple[str, ...]]
"""For each type, those that must have been observed at an earlier step."""


def checked_parents(parents: Any, names: tuple[str, ...]) -> dict[str, tuple[str, ...]]:
    """Parents as tuples.

    Raises:
        UserError: no mapping of lists, a name that is no type, or types that wait for one another.
    """
    if not isinstance(parents, Mapping):
        raise UserError(f"parents = {parents!r}: give a mapping from type to parents, such as {{'B': ['A']}}")
    for name, above in parents.items():
        if isinstance(above, str) or not isinstance(above, Sequence):
            raise UserError(
                f"parents = {parents!r}: give {name} a list of types, such as {{'{name}': ['A']}}"
            )
    graph = {name: tuple(above) for name, above in parents.items()}
    for name in [*graph, *(parent for above in graph.values() for parent in above)]:
        if name not in names:
            raise unknown_name("POI type in parents", str(name), names)
    if cycle := waiting_forever([(name,) for name in names], graph):
        raise UserError(f"parents = {graph}: cycle among {cycle}; remove one of these parents")
    return graph


def checked_groups(groups: Any, names: tuple[str, ...]) -> tuple[Group, ...]:
    """Groups as tuples.

    Raises:
        UserError: no list of lists, a name that is no type, a type named twice, or a group of one.
    """
    mend = f"simultaneous = {groups!r}: give groups of types, such as (('A', 'B'), ('C', 'D'))"
    if not _is_list(groups) or not all(_is_list(group) for group in groups):
        raise UserError(mend)
    named: set[str] = set()
    for group in groups:
        if len(group) < 2:
            raise UserError(
                f"simultaneous = {groups!r}: a group needs at least two types; leave out {group!r}"
            )
        for name in group:
            if name not in names:
                raise unknown_name("POI type in simultaneous", str(name), names)
            if name in named:
                raise UserError(
                    f"simultaneous = {groups!r}: {name} is named twice; give each type once at most"
                )
            named.add(name)
    return tuple(tuple(group) for group in groups)


def with_singles(groups: Iterable[Group], names: tuple[str, ...]) -> list[Group]:
    """The groups, and each type that is in none by itself, in the order of their first types."""
    together = {name: group for group in groups for name in group}
    found = dict.fromkeys(together.get(name, (name,)) for name in names)
    return list(found)


def chain(groups: Sequence[Group]) -> dict[str, tuple[str, ...]]:
    """The parents if groups are to be observed one after another: all types of the group before."""
    before = [(), *groups]
    return {name: before[place] for place, group in enumerate(groups) for name in group}


def sorted_by_parents(groups: Sequence[Group], parents: Graph) -> list[Group]:
    """The groups in an order in which they can be observed; those that never can are left out."""
    order: list[Group] = []
    while True:
        done = {name for group in order for name in group}
        ready = [
            group
            for group in groups
            if group not in order and all(done.issuperset(parents.get(name, ())) for name in group)
        ]
        if not ready:
            return order
        order.extend(ready)


def waiting_forever(groups: Sequence[Group], parents: Graph) -> str:
    """The types that can never be observed, since they wait for one another; empty if there are none."""
    possible = sorted_by_parents(groups, parents)
    return ", ".join(sorted(name for group in groups if group not in possible for name in group))


def _is_list(value: Any) -> bool:
    return isinstance(value, Sequence) and not isinstance(value, str)
