"""Steps of many worlds beside an oracle's, leaving out worlds in which rounding could decide."""

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np

CLOSE = dict(rtol=5e-5, atol=2e-5)
BORDER = 1e-4
"""Metres from a border at which float32 may decide otherwise."""


def one_world(kind: type, states: Any, w: int) -> Any:
    """One of many worlds as an oracle's state, in float64."""
    fields = {}
    for field in dataclasses.fields(kind):
        leaf = np.asarray(getattr(states, field.name))[..., w]
        fields[field.name] = leaf.astype(np.float64) if leaf.dtype.kind == "f" else leaf
    fields["time"] = int(fields["time"])
    return kind(**fields)


def assert_same_steps(
    step: Callable[..., Any], kind: type, skills: tuple[str, ...], states: Any, actions: Any, ours: Any
) -> tuple[float, list[Any]]:
    """Compares the new states and all that is returned.

    Args:
        step: the oracle's, of a state and an action: a state, an outcome, and how close it was.
        ours: what `step_worlds` gave.

    Returns:
        The share of worlds that were compared, and (before, after, outcome) of each.
    """
    after, returned = ours
    worlds, said = actions.shape[-1], []
    for w in range(worlds):
        before = one_world(kind, states, w)
        expected, outcome, gap = step(before, np.asarray(actions, np.float64)[..., w])
        if gap <= BORDER:
            continue
        said.append((before, expected, outcome))
        for field in dataclasses.fields(kind):
            got = np.asarray(getattr(after, field.name))[..., w]
            np.testing.assert_allclose(got, getattr(expected, field.name), **CLOSE, err_msg=field.name)
        for name in ("observation", "team_reward", "terminated", "truncated"):
            got = np.asarray(getattr(returned, name))[..., w]
            np.testing.assert_allclose(got, getattr(outcome, name), **CLOSE, err_msg=name)
        paid = np.stack([outcome.local_rewards[skill] for skill in skills], axis=1)
        np.testing.assert_allclose(np.asarray(returned.local_rewards)[..., w], paid, **CLOSE, err_msg="local")
    return len(said) / worlds, said
