"""Methods that are compared under names of their own: an algorithm with some options."""

import dataclasses
from collections.abc import Mapping
from typing import Any

from skillcrew.algorithms.algorithm import Algorithm
from skillcrew.algorithms.registry import make_algorithm
from skillcrew.envs.environment import Environment
from skillcrew.experiment.config import algorithm_of


@dataclasses.dataclass(frozen=True)
class Form:
    """An algorithm in another form than its default one."""

    section: Mapping[str, Any]
    """As the section `algorithm` of a configuration file: its name, and the fields that differ."""
    said: str = ""
    """What its label says beyond the algorithm's."""


_REMEMBERING = {"policy": {"hidden": [64], "memory": 32}, "critic": {"memory": 32}}


def _over_skills(name: str, **fields: Any) -> Form:
    return Form({"name": name, "choose": "skills", "hold": 5, **_REMEMBERING, **fields})


FORMS: Mapping[str, Form] = {
    "open-loop-team": Form({"name": "open-loop", "selector": {"sharing": "team"}}, ", shared"),
    **{f"{name}-skills": _over_skills(name) for name in ("mappo", "ippo", "coma")},
    # Published for returns of about 20; these are of 1 at most.
    "liir-skills": _over_skills("liir", liir={"weight": 0.001}),
    "mappo-actions": Form({"name": "mappo", **_REMEMBERING}),
}
"""The others are called by their algorithms' names. Choices among skills are kept for five steps, by policies
and critics with memory: of the forms of MAPPO that were tried the best on seeds that no table has."""


def make_method(method: str, env: Environment) -> tuple[Algorithm, str]:
    """A method in an environment, all its other options at the defaults; and its label.

    Raises:
        UserError: an unknown name, or an environment that the algorithm cannot learn in.
    """
    if method not in FORMS:
        algorithm = make_algorithm(method, env)
        return algorithm, algorithm.label
    form = FORMS[method]
    algorithm = algorithm_of(dict(form.section), method, env)
    return algorithm, algorithm.label + form.said
