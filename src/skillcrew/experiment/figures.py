"""What is reproduced: each figure's environments, the methods compared there, and how long each lives."""

from collections.abc import Mapping, Sequence

from skillcrew.errors import unknown_name

Methods = Mapping[tuple[str, ...], int]
"""Methods, and how many environment steps each of their seeds lives. Those that commit to phases, and those
that choose among skills, need a fraction of what the others do."""

OF_THE_THESIS = ("madys", "mfl", "ea")
"""Algorithms in the thesis's form: feed-forward networks, one for each agent."""

COMMITTED = ("madys-plus", "open-loop", "open-loop-team")
"""Algorithms whose selectors have phases; the last is the open loop with one timetable for the whole team."""

CHOOSING = ("madys-plus", "open-loop", "madys", "mfl", "ea", "ccea", "merl")
"""Algorithms that are compared where teams have to choose while they look."""

OVER_SKILLS = ("mappo-skills", "ippo-skills", "coma-skills", "liir-skills")
"""Policy gradients that choose among the same skills as MADyS."""

ON_ACTIONS = ("mappo-actions", "maddpg", "matd3")
"""The same, and critics of the whole team, without skills."""

TWO_TYPES, THREE_TYPES = (tuple(f"rover-t{types}-c{coupling}" for coupling in (1, 2, 3)) for types in (2, 3))

DENSE = "-dense"
"""Ends the name of an environment whose team is paid for each type as it is observed."""

_ES, _OURS = ("madys-es",), COMMITTED[:2]
_THESIS: Mapping[str, Methods] = {
    "rover-t2-c1": {OF_THE_THESIS: 6_000_000, _ES: 6_000_000, _OURS: 3_000_000},
    "rover-t2-c2": {OF_THE_THESIS: 8_000_000, _ES: 6_000_000, _OURS: 4_000_000},
    "rover-t2-c3": {OF_THE_THESIS: 6_000_000, _ES: 6_000_000, _OURS: 3_000_000},
    "rover-t3-c1": {OF_THE_THESIS: 10_000_000, _ES: 12_000_000, _OURS: 5_000_000},
    "rover-t3-c2": {OF_THE_THESIS: 10_000_000, _ES: 20_000_000, _OURS: 5_000_000},
    "rover-t3-c3": {OF_THE_THESIS: 10_000_000, _ES: 24_000_000, _OURS: 5_000_000},
}
_FRONTIER = {
    "rover-t4-c3": 10_000_000,
    "rover-t5-c3": 15_000_000,
    "rover-t6-c3": 20_000_000,
    "rover-t3-c6": 6_000_000,
    "rover-t3-c12": 4_000_000,
    "rover-t2-c2-tight": 10_000_000,
    "rover-t3-c3-tight": 10_000_000,
    "rover-t3-c3-drawn": 30_000_000,
    "rover-t4-c3-simultaneous": 15_000_000,
    "rover-t2-c2-moving": 10_000_000,
    "rover-t4-c3-breakdown": 10_000_000,
}
_RIVALS = 2_000_000
_PROXIMAL = {"rover-t3-c3": 3_000_000, "rover-t3-c3-drawn": 3_000_000}
"""How long proximal policies live where `_RIVALS` does not show how they end."""
_ON_THE_FRONTIER = (
    *("rover-t4-c3", "rover-t3-c6", "rover-t2-c2-tight", "rover-t3-c3-tight", "rover-t3-c3-drawn"),
    *("rover-t4-c3-simultaneous", "rover-t2-c2-moving", "rover-t4-c3-breakdown"),
)


def _frontier(*environments: str) -> Mapping[str, Methods]:
    return {name: {COMMITTED: _FRONTIER[name]} for name in environments}


def _over_skills(environment: str) -> Methods:
    return {OVER_SKILLS[:2]: _PROXIMAL.get(environment, _RIVALS), OVER_SKILLS[2:]: _RIVALS}


def _beside_the_thesis(environment: str) -> Methods:
    """Rivals with and without skills; ours are the runs of the thesis's figures."""
    steps = {method: steps for methods, steps in _THESIS[environment].items() for method in methods}
    ours = {(method,): steps[method] for method in ("madys-plus", "madys")}
    return {**ours, **_over_skills(environment), ON_ACTIONS: _RIVALS}


FIGURES: Mapping[str, Mapping[str, Methods]] = {
    "fig-4.2": {name: _THESIS[name] for name in TWO_TYPES},
    "fig-4.3": {name: _THESIS[name] for name in THREE_TYPES},
    "types": _frontier("rover-t4-c3", "rover-t5-c3", "rover-t6-c3"),
    "rovers": _frontier("rover-t3-c6", "rover-t3-c12"),
    "looking": _frontier("rover-t2-c2-tight", "rover-t3-c3-tight", "rover-t3-c3-drawn"),
    "splitting": _frontier("rover-t4-c3-simultaneous", "rover-t2-c2-moving", "rover-t4-c3-breakdown"),
    "rescue": {
        "rescue-v1-c2": {CHOOSING: 10_000_000},
        "rescue-v2-c2": {CHOOSING: 6_000_000},
        "rescue-v3-c3": {CHOOSING: 8_000_000},
    },
    "warehouse": {
        "warehouse-o1-c2": {CHOOSING: 6_000_000},
        "warehouse-o2-c2": {CHOOSING: 10_000_000},
        "warehouse-o3-c3": {CHOOSING: 8_000_000},
    },
    "rivals-thesis": {name: _beside_the_thesis(name) for name in (*TWO_TYPES, *THREE_TYPES)},
    "rivals-frontier": {
        name: {("madys-plus",): _FRONTIER[name], **_over_skills(name)} for name in _ON_THE_FRONTIER
    },
    "rivals-dense": {
        f"{name}{DENSE}": {("madys-plus", "madys", *OVER_SKILLS, *ON_ACTIONS): _RIVALS}
        for name in (*TWO_TYPES, *THREE_TYPES)
    },
}
"""What each shows: environments, a panel each, and the methods in them."""

SETS: Mapping[str, tuple[str, ...]] = {
    "all": ("fig-4.2", "fig-4.3"),
    "frontier": ("types", "rovers", "looking", "splitting"),
    "domains": ("rescue", "warehouse"),
    "rivals": ("rivals-thesis", "rivals-frontier", "rivals-dense"),
}
"""Figures that belong together: the thesis's, those beyond it, other domains', the gradient rivals'."""


def environments() -> list[str]:
    """All that figures show, each once; its name is a figure of its own."""
    return list(dict.fromkeys(name for panels in FIGURES.values() for name in panels))


def figures_of(name: str) -> tuple[str, ...]:
    """The figures that a name stands for: one or a set of them, or a single environment's panel.

    Raises:
        UserError: an unknown name.
    """
    if name in SETS:
        return SETS[name]
    if name not in FIGURES and name not in environments():
        raise unknown_name("figure", name, (*FIGURES, *SETS, *environments()))
    return (name,)


def panels_of(figure: str) -> Mapping[str, Methods]:
    """The environments of a figure; the one of that name, as the first figure shows it which does."""
    if figure in FIGURES:
        return FIGURES[figure]
    return {figure: next(panels[figure] for panels in FIGURES.values() if figure in panels)}


def methods_of(figures: Sequence[str]) -> dict[tuple[str, str], int]:
    """Each environment and method of some figures, once and in order, and the steps that a seed lives."""
    return {
        (environment, method): steps
        for figure in figures
        for environment, methods in panels_of(figure).items()
        for names, steps in methods.items()
        for method in names
    }
