"""Which number was the first that is none, and counts that have begun again."""

import copy
import dataclasses
from collections.abc import Mapping
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, PyTree

from skillcrew.algorithms.algorithm import Algorithm
from skillcrew.envs.environment import Environment
from skillcrew.errors import UserError
from skillcrew.experiment import generation
from skillcrew.experiment.config import RunConfig
from skillcrew.experiment.generation import RunState


def first_bad(algorithm: Algorithm, config: RunConfig, before: RunState) -> str:
    """What went wrong first in a generation, in words.

    Args:
        before: one seed's state before that generation.
    """
    watch = _Watch(algorithm.env)
    kind: Any = type(algorithm)
    watched = kind(watch.env, algorithm.config)
    budget = jnp.asarray(config.steps, jnp.int32)
    after, metrics = jax.jit(lambda run: generation.one_generation(watched, config, budget, run))(before)
    jax.block_until_ready(metrics)
    jax.effects_barrier()
    if watch.seen:
        return watch.seen
    looked_at = (after.algorithm, {name: metrics[name] for name in generation.ALWAYS_NUMBERS})
    for path, leaf in jax.tree_util.tree_flatten_with_path(looked_at)[0]:
        if jnp.issubdtype(leaf.dtype, jnp.floating) and np.isnan(leaf).any():
            where = np.argwhere(np.isnan(leaf))[0].tolist()
            return f"{jax.tree_util.keystr(path[1:])}{where or ''} is NaN"
    return "a number is NaN, and is not when it is computed again"


def check_counts(algorithm: Algorithm, config: RunConfig, metrics: Mapping[str, np.ndarray]) -> None:
    """Refuses an algorithm that adds up its steps beyond 32 bits: its seeds would be within the budget again.

    Args:
        metrics: with axes [seeds, generations].

    Raises:
        UserError: a count below 0.
    """
    steps = metrics["environment_steps"]
    for seed, row in np.argwhere(steps < 0)[:1]:
        raise UserError(
            f"environment_steps of seed {config.seeds[seed]} = {steps[seed, row]} in generation "
            f"{metrics['generation'][seed, row]}: more than 32 bits count; let {algorithm.name} add them up "
            "by skillcrew.rollout.count_steps, or give fewer --steps"
        )


class _Watch:
    """An environment that notes the first number which is not finite, of a world that is still running."""

    def __init__(self, env: Environment):
        self.seen = ""
        self._running: Any = None
        self._step = 0
        self._skills = env.skills
        self.env = self._watched(env)

    def _watched(self, env: Environment) -> Environment:
        watch, kind = self, type(env)

        def reset_worlds(env: Any, keys: Array) -> tuple[PyTree, Any]:
            state, observation = kind.reset_worlds(env, keys)
            jax.debug.callback(watch._begins, observation, ordered=True)
            return state, observation

        def step_worlds(env: Any, state: PyTree, action: Any, keys: Array) -> tuple[PyTree, Any]:
            state, step = kind.step_worlds(env, state, action, keys)
            told = {field.name: getattr(step, field.name) for field in dataclasses.fields(step)}
            jax.debug.callback(watch._goes_on, told, ordered=True)
            return state, step

        watched = copy.copy(env)
        methods = {"reset_worlds": reset_worlds, "step_worlds": step_worlds, "__module__": kind.__module__}
        watched.__class__ = type(kind.__name__, (kind,), methods)
        return watched

    def _begins(self, observation: PyTree) -> None:
        self._step = 0
        self._running = np.ones(np.shape(jax.tree.leaves(observation)[0])[-1], bool)
        self._look("observation", observation)

    def _goes_on(self, told: dict[str, Any]) -> None:
        self._step += 1
        if len(told["terminated"]) != len(self._running):
            self._running = np.ones(len(told["terminated"]), bool)
        for name in ("observation", "local_rewards", "team_reward"):
            self._look(name, told[name])
        self._running = self._running & ~np.asarray(told["terminated"]) & ~np.asarray(told["truncated"])

    def _look(self, quantity: str, numbers: PyTree) -> None:
        if self.seen:
            return
        for path, leaf in jax.tree_util.tree_flatten_with_path(numbers)[0]:
            bad = np.argwhere(~np.isfinite(leaf) & self._running)
            if len(bad):
                kind = f" of {path[0].key}" if path else ""
                number = float(np.asarray(leaf)[tuple(bad[0])])
                self.seen = self._said(quantity, kind, bad[0].tolist(), number)
                return

    def _said(self, quantity: str, kind: str, place: list[int], number: float) -> str:
        what = quantity.replace("_", " ")
        if quantity == "local_rewards":
            skill = f" of {self._skills[place[1]]}" if not kind else f"[{place[1]}]"
            what = f"local reward{skill}"
        elif quantity == "observation":
            what = f"observation[{place[1]}]"
        agent = f" for agent {place[0]}" if len(place) > 1 else ""
        when = f"after step {self._step}" if self._step else "at the beginning"
        return f"{what} is {'NaN' if np.isnan(number) else 'infinite'}{agent}{kind}, {when} of an episode"
