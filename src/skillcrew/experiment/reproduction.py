"""The thesis's experiments, and those beyond it, as comparisons."""

import dataclasses
from collections.abc import Sequence
from typing import Any

from skillcrew.algorithms.registry import make_algorithm
from skillcrew.envs.environment import Environment
from skillcrew.envs.registry import make
from skillcrew.errors import UserError
from skillcrew.experiment.comparison import ComparedFigure, Comparison, PlannedRun
from skillcrew.experiment.config import RunConfig
from skillcrew.experiment.figures import DENSE, methods_of, panels_of
from skillcrew.experiment.methods import make_method

LEAST_STEPS = 200_000
"""Whatever the budget, so that every method lives more than one generation: one takes up to 100,000 steps."""

SEEDS = (2000, 2001, 2002, 2003, 2004)
"""The thesis's five."""

PURPOSE = "This folder reproduces figures of the MADyS thesis, or beyond it, with skillcrew."


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
        _planned(environment, method, RunConfig(seeds, max(LEAST_STEPS, round(budget * steps))), budget)
        for (environment, method), steps in methods_of(figures).items()
    ]


def _drawn(figure: str, seeds: tuple[int, ...]) -> ComparedFigure:
    said = f"mean of {len(seeds)} seeds, 95 % intervals"
    title = f"Figure {figure[4:]} of the thesis, again: {said}" if figure.startswith("fig-") else said
    return ComparedFigure(figure, title, tuple(panels_of(figure)))


def _planned(environment: str, method: str, config: RunConfig, budget: float) -> PlannedRun:
    algorithm, label = make_method(method, _environment(environment))
    shortened = _shortened(algorithm.config, budget)
    algorithm = make_algorithm(algorithm.name, algorithm.env, shortened)
    return PlannedRun(environment, method, label, algorithm, config)


def _environment(name: str) -> Environment:
    """A preset, or one whose team is paid for each type as it is observed."""
    if name.endswith(DENSE):
        return make(name.removesuffix(DENSE), team_reward="fraction")
    return make(name)


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
