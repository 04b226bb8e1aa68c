"""The thesis's experiments as a comparison."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

from skillcrew.algorithms.registry import make_algorithm
from skillcrew.envs.presets import make
from skillcrew.errors import UserError, unknown_name
from skillcrew.experiment.comparison import ComparedFigure, Comparison, PlannedRun
from skillcrew.experiment.config import RunConfig

FIGURES: Mapping[str, tuple[str, ...]] = {
    "fig-4.2": ("rover-t2-c1", "rover-t2-c2", "rover-t2-c3"),
    "fig-4.3": ("rover-t3-c1", "rover-t3-c2", "rover-t3-c3"),
}
"""The thesis's figures, and the environments that they show."""

METHODS = ("madys", "mfl", "ea", "madys-plus")
"""Algorithms that are compared. The first three have the thesis's form: feed-forward networks, one for each
agent."""

STEPS: Mapping[str, int] = {
    "rover-t2-c1": 6_000_000,
    "rover-t2-c2": 16_000_000,
    "rover-t2-c3": 12_000_000,
    "rover-t3-c1": 24_000_000,
    "rover-t3-c2": 32_000_000,
    "rover-t3-c3": 40_000_000,
}
"""Environment steps per seed, the same for all methods."""

LEAST_STEPS = 200_000
"""Whatever the budget, so that every method lives more than one generation: one takes up to 100,000 steps."""

SEEDS = (2000, 2001, 2002, 2003, 2004)
"""The thesis's five."""

PURPOSE = "This folder reproduces figures of the MADyS thesis with skillcrew."


def figures_of(name: str) -> tuple[str, ...]:
    """The figures that a name stands for: one of `FIGURES`, `all` of them, or a single environment's panel.

    Raises:
        UserError: an unknown name.
    """
    if name == "all":
        return tuple(FIGURES)
    if name not in FIGURES and name not in STEPS:
        raise unknown_name("figure", name, (*FIGURES, "all", *STEPS))
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
        for method in METHODS
    ]


def _drawn(figure: str, seeds: tuple[int, ...]) -> ComparedFigure:
    said = f"mean of {len(seeds)} seeds, 95 % intervals"
    title = f"{figure.replace('fig-', 'Figure ')} of the thesis, again: {said}" if figure in FIGURES else said
    return ComparedFigure(figure, title, environments_of(figure))


def _planned(environment: str, method: str, seeds: tuple[int, ...], budget: float) -> PlannedRun:
    algorithm = make_algorithm(method, make(environment))
    shortened = _shortened(algorithm.config, budget)
    steps = max(LEAST_STEPS, round(budget * STEPS[environment]))
    return PlannedRun(
        environment,
        method,
        algorithm.label,
        make_algorithm(method, algorithm.env, shortened),
        RunConfig(seeds=seeds, steps=steps),
    )


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
