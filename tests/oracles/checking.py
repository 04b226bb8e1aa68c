"""What `check_environment` says, in a fraction of the time."""

from typing import Any
from unittest import mock

import jax

import skillcrew as sc
from skillcrew.envs.checks import play
from skillcrew.envs.checks.report import Finding

AT_A_GLANCE = {"WORLDS": 16, "MEASURED_SECONDS": 0.01}
"""What `play` measures speed by, where nobody asks how high it is."""


def complaints(env: Any) -> list[Finding]:
    """All that is not fine. Steps are compiled: operation by operation they take minutes."""
    for name in ("reset", "step", "reset_worlds", "step_worlds"):
        setattr(env, name, jax.jit(getattr(env, name)))
    jax.config.update("jax_disable_most_optimizations", True)
    try:
        with mock.patch.multiple(play, **AT_A_GLANCE):
            return [one for one in sc.check_environment(env).findings if one.level != "fine"]
    finally:
        jax.config.update("jax_disable_most_optimizations", False)
