"""The thesis's experiments, and those beyond it, as comparisons."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

from skillcrew.algorithms.algorithm import Algorithm
from skillcrew.algorithms.open_loop import OpenLoop, OpenLoopConfig
from skillcrew.algorithms.registry import make_algorithm
from skillcrew.envs.registry import make
from skillcrew.errors import UserError, unknown_name
from skillcrew.experiment.comparison import ComparedFigure, Comparison, PlannedRun
from skillcrew.experiment.config import RunConfig

FIGURES: Mapping[str, tuple[str, ...]] = {
    "fig-4.2": ("rover-t2-c1", "rover-t2-c2", "rover-t2-c3"),
    "fig-4.3": ("rover-t3-c1", "rover-t3-c2", "rover-t3-c3"),
    "types": ("rover-t4-c3", "rover-t5-c3", "rover-t6-c3"),
    "rovers": ("rover-t3-c6", "rover-t3-c12"),
    "looking": ("rover-t2-c2-tight", "rover-t3-c3-tight", "rover-t3-c3-drawn"),
    "splitting": ("rover-t4-c3-simultaneous", "rover-t2-c2-moving", "rover-t4-c3-breakdown"),
    "rescue": ("rescue-v1-c2", "rescue-v2-c2", "rescue-v3-c3"),
    "warehouse": ("warehouse-o1-c2", "warehouse-o2-c2", "warehouse-o3-c3"),
}
"""The thesis's figures and those beyond it, and the environments that each shows."""

SETS: Mapping[str, tuple[str, ...]] = {
    "all": ("fig-4.2", "fig-4.3"),
    "frontier": ("types", "rovers", "looking", "splitting"),
    "domains": ("rescue", "warehouse"),
}
"""Figures that belong together: the thesis's, those beyond it, and those of other domains."""

OF_THE_THESIS = ("madys", "mfl", "ea")
"""Algorithms in the thesis's form: feed-forward networks, one for each agent."""

COMMITTED = ("madys-plus", "open-loop", "open-loop-team")
"""Algorithms whose selectors have phases; the last is the open loop with one timetable for the whole team."""

CHOOSING = ("madys-plus", "open-loop", "madys", "mfl", "ea", "ccea", "merl")
"""Algorithms that are compared where teams have to choose while they look."""

STEPS: Mapping[str, Mapping[tuple[str, ...], int]] = {
    "rover-t2-c1": {OF_THE_THESIS: 6_000_000, ("madys-es",): 6_000_000, COMMITTED[:2]: 3_000_000},
    "rover-t2-c2": {OF_THE_THESIS: 8_000_000, ("madys-es",): 6_000_000, COMMITTED[:2]: 4_000_000},
    "rover-t2-c3": {OF_THE_THESIS: 6_000_000, ("madys-es",): 6_000_000, COMMITTED[:2]: 3_000_000},
    "rover-t3-c1": {OF_THE_THESIS: 10_000_000, ("madys-es",): 12_000_000, COMMITTED[:2]: 5_000_000},
    "rover-t3-c2": {OF_THE_THESIS: 10_000_000, ("madys-es",): 20_000_000, COMMITTED[:2]: 5_000_000},
    "rover-t3-c3": {OF_THE_THESIS: 10_000_000, ("madys-es",): 24_000_000, COMMITTED[:2]: 5_000_000},
    "rover-t4-c3": {COMMITTED: 10_000_000},
    "rover-t5-c3": {COMMITTED: 15_000_000},
    "rover-t6-c3": {COMMITTED: 20_000_000},
    "rover-t3-c6": {COMMITTED: 6_000_000},
    "rover-t3-c12": {COMMITTED: 4_000_000},
    "rover-t2-c2-tight": {COMMITTED: 10_000_000},
    "rover-t3-c3-tight": {COMMITTED: 10_000_000},
    "rover-t3-c3-drawn": {COMMITTED: 30_000_000},
    "rover-t4-c3-simultaneous": {COMMITTED: 15_000_000},
    "rover-t2-c2-moving": {COMMITTED: 10_000_000},
    "rover-t4-c3-breakdown": {COMMITTED: 10_000_000},
    "rescue-v1-c2": {CHOOSING: 10_000_000},
    "rescue-v2-c2": {CHOOSING: 6_000_000},
    "rescue-v3-c3": {CHOOSING: 8_000_000},
    "warehouse-o1-c2": {CHOOSING: 6_000_000},
    "warehouse-o2-c2": {CHOOSING: 10_000_000},
    "warehouse-o3-c3": {CHOOSING: 8_000_000},
}
"""For each environment the methods that are compared there, and how many environment steps each of their
seeds lives. Those that commit need a fraction of what the others do."""

LEAST_STEPS = 200_000
"""Whatever the budget, so that every method lives more than one generation: one takes up to 100,000 steps."""

SEEDS = (2000, 2001, 2002, 2003, 2004)
"""The thesis's five."""

PURPOSE = "This folder reproduces figures of the MADyS thesis, or beyond it, with skillcrew."


def steps_of(environment: str) -> dict[str, int]:
    """The methods that are compared in an environment, in order, and the environment steps of their seeds."""
    return {method: steps for methods, steps in STEPS[environment].items() for method in methods}


def figures_of(name: str) -> tuple[str, ...]:
    """The figures that a name stands for: one or a set of them, or a single environment's panel.

    Raises:
        UserError: an unknown name.
    """
    if name in SETS:
        return SETS[name]
    if name not in FIGURES and name not in STEPS:
        raise unknown_name("figure", name, (*FIGURES, *SETS, *STEPS))
    return (name,)


def environments_of(figure: str) -> tuple[str, ...]:
    """What a figure shows, a panel each; an environment's name is the figure of its panel alone."""
    return FIGURES.get(figure, (figure,))


def reproduction(figures: Sequence[str], seeds: tuple[int, ...] = SEEDS, budget: float = 1.0) -> Comparison:
    """The comparison that ends in some figures; for arguments and errors see `plan`."""
    return Comparison(PURPOSE, plan(figures, seeds, budget), [_drawn(figure, seeds) for figure in figures])


def plan(figures: Sequence[str], seeds: tuple[int, ...] = SEEDS, budget: float = 1.0) -> list[PlannedRun]:
    """The runs behind some figures.

    Args:
        figures: as `figures_of` gives them.
        budget: share of the full number of environment steps (but see `LEAST_STEPS`), and of the time that
            skills are given to learn: MFL's pre-training, and the generations of the plateau rule.

    Raises:
        UserError: a budget that is not a share above 0.
    """
    if not 0 < budget <= 1:
        raise UserError(f"--budget {budget}: give a share above 0 and up to 1, such as 0.02")
    return [
        _planned(environment, method, seeds, budget)
        for figure in figures
        for environment in environments_of(figure)
        for method in steps_of(environment)
    ]


def _drawn(figure: str, seeds: tuple[int, ...]) -> ComparedFigure:
    said = f"mean of {len(seeds)} seeds, 95 % intervals"
    title = f"Figure {figure[4:]} of the thesis, again: {said}" if figure.startswith("fig-") else said
    return ComparedFigure(figure, title, environments_of(figure))


def _planned(environment: str, method: str, seeds: tuple[int, ...], budget: float) -> PlannedRun:
    algorithm = _algorithm(environment, method)
    shortened = _shortened(algorithm.config, budget)
    steps = max(LEAST_STEPS, round(budget * steps_of(environment)[method]))
    label = f"{algorithm.label}, shared" if method == "open-loop-team" else algorithm.label
    return PlannedRun(
        environment,
        method,
        label,
        make_algorithm(algorithm.name, algorithm.env, shortened),
        RunConfig(seeds=seeds, steps=steps),
    )


def _algorithm(environment: str, method: str) -> Algorithm:
    """A method with the defaults of its algorithm, but for what its name says."""
    if method != "open-loop-team":
        return make_algorithm(method, make(environment))
    shared = dataclasses.replace(OpenLoopConfig().selector, sharing="team")
    return OpenLoop(make(environment), selector=shared)


def _shortened(config: Any, budget: float) -> Any:
    """An algorithm's configuration with all that takes time before the search begins in earnest cut down.

    Gradients are nine tenths of what a run costs while skills learn, more than a quick look can afford.
    """

    def share(whole: int) -> int:
        return max(1, round(budget * whole))

    changes: dict[str, Any] = {}
    if hasattr(config, "pretraining_steps"):
        changes["pretraining_steps"] = share(config.pretraining_steps)
    if hasattr(config, "plateau"):
        plateau = config.plateau
        longest = plateau.earliest + plateau.window
        # A skill learns no more in the generation in which it stops.
        latest = share(longest) + 1 if budget < 1 else None
        changes["plateau"] = dataclasses.replace(plateau, latest=latest)
    return dataclasses.replace(config, **changes)
