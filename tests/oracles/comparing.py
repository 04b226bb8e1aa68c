"""Steps of many worlds beside an oracle's, leaving out worlds in which rounding could decide."""

import dataclasses
import functools
from collections.abc import Callable
from types import ModuleType
from typing import Any

import jax
import jax.numpy as jnp
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
    states, acted = jax.device_get(states), np.asarray(actions, np.float64)
    after, returned = jax.device_get(ours)
    kept, said = [], []
    for w in range(acted.shape[-1]):
        before = one_world(kind, states, w)
        expected, outcome, gap = step(before, acted[..., w])
        if gap > BORDER:
            kept.append(w)
            said.append((before, expected, outcome))

    def assert_same(name: str, got: np.ndarray, expected: list[Any]) -> None:
        np.testing.assert_allclose(got[..., kept], np.stack(expected, axis=-1), **CLOSE, err_msg=name)

    for field in dataclasses.fields(kind):
        expected = [getattr(state, field.name) for _, state, _ in said]
        assert_same(field.name, getattr(after, field.name), expected)
    for name in ("observation", "team_reward", "terminated", "truncated"):
        assert_same(name, getattr(returned, name), [getattr(outcome, name) for _, _, outcome in said])
    paid = [np.stack([outcome.local_rewards[skill] for skill in skills], axis=1) for _, _, outcome in said]
    assert_same("local rewards", returned.local_rewards, paid)
    return len(kept) / acted.shape[-1], said


def steps_compared(
    oracle: ModuleType, cases: ModuleType, case: str, seed: int, steps: int = 3
) -> tuple[list[float], list[Any]]:
    """Of some steps in a row, each compared: the share of worlds that count, and what happened.

    Args:
        oracle: has `step` and `State`.
        cases: has `environment`, `compiled_step`, `random_states` and `WORLDS`.
    """
    env, rng = cases.environment(case), np.random.default_rng(seed)
    states = cases.random_states(env.config, rng)
    keys = jax.random.split(jax.random.key(seed), cases.WORLDS)
    shares, happened = [], []
    for _ in range(steps):
        actions = random_actions(env.config, rng, cases.WORLDS)
        ours = cases.compiled_step(case)(states, actions, keys)
        step = functools.partial(oracle.step, env.config)
        share, said = assert_same_steps(step, oracle.State, env.skills, states, actions, ours)
        shares.append(share)
        happened += said
        states = ours[0]
    return shares, happened


def random_actions(config: Any, rng: np.random.Generator, worlds: int) -> jax.Array:
    """Some beyond [-1, 1]; in half of the worlds all go about the same way."""
    alone = rng.uniform(-1.3, 1.3, (config.n_agents, 2, worlds))
    alike = rng.uniform(-1.3, 1.3, (1, 2, worlds)) + 0.2 * alone
    return jnp.asarray(np.where(rng.random(worlds) < 0.5, alone, alike).astype(np.float32))


def stacked(kind: type, one_each: list[dict[str, Any]]) -> Any:
    """Worlds as one state of ours, the world axis last."""
    fields = {name: np.stack([one[name] for one in one_each], axis=-1) for name in one_each[0]}
    types = {"f": np.float32, "i": np.int32, "b": bool}
    return kind(
        **{name: jnp.asarray(values.astype(types[values.dtype.kind])) for name, values in fields.items()}
    )
