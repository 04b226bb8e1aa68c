"""The jitted program of a run: chunks of generations over a leading seed axis."""

import operator
import os
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Int, Key, PyTree, UInt32

from skillcrew.algorithms.algorithm import Algorithm
from skillcrew.experiment import device_memory
from skillcrew.experiment.config import RunConfig
from skillcrew.experiment.score import RETURN, measured
from skillcrew.policies.team import Team
from skillcrew.rollout import Lineup, Start, Trajectories, rollout

OPTIMIZATION_LEVEL = "xla_backend_optimization_level"
"""XLA's option for how much LLVM does. On a CPU, what it adds beyond its first level makes a run's program
compile half as long again, and run no faster."""

ALWAYS_NUMBERS = ("fitness_best", "fitness_mean", RETURN.key)
"""Metrics that are never NaN if all is well; the loss of a skill that does not learn is."""

TRAINING, SCORING, REPLAY, EVALUATION = 0, 1, 2, 0x5EED
"""Numbers of a seed's streams of random numbers: what it trains by, the scores of its curve, the episodes to
look at, and the score in the end. JAX's fold of different numbers into one key gives different keys."""


class RunState(eqx.Module):
    """All that a run goes on from, for one seed; the runner stacks seeds in front."""

    algorithm: PyTree
    team: Any
    """The champion at the last generation within the budget of environment steps."""
    score_key: Key[Array, "*seeds"]
    generation: Int[Array, "*seeds"]
    environment_steps: Int[Array, "*seeds"]


def initial_state(algorithm: Algorithm, seed: UInt32[Array, ""]) -> RunState:
    """The state before the first generation of one seed."""
    state, score_key = algorithm.init(stream(seed, TRAINING)), stream(seed, SCORING)
    zero = jnp.zeros((), jnp.int32)
    return as_restored(RunState(state, algorithm.team(state), score_key, zero, zero))


def as_restored(state: PyTree) -> PyTree:
    """A state as a checkpoint gives it back, so that a resumed run is the same program."""
    return jax.tree.map(_strongly_typed, state)


def stream(seed: UInt32[Array, ""], number: int) -> Key[Array, ""]:
    """The root of one of a seed's streams of random numbers, by its number: `TRAINING` or another."""
    return jax.random.fold_in(jax.random.key(seed), number)


def one_generation(
    algorithm: Algorithm, config: RunConfig, budget: Int[Array, ""], run: RunState
) -> tuple[RunState, dict[str, Array]]:
    """One generation of one seed, and its champion's score on fresh episodes."""
    state, metrics = algorithm.step(run.algorithm)
    champion = algorithm.team(state)
    within_budget = metrics["environment_steps"] <= budget
    team = jax.tree.map(lambda new, old: jnp.where(within_budget, new, old), champion, run.team)
    generation = run.generation + 1
    key = jax.random.fold_in(run.score_key, generation)
    scores = measured(algorithm.env, play(algorithm, champion, key, config.score_episodes))
    metrics = {"generation": generation, **metrics, **scores}
    return RunState(state, team, run.score_key, generation, metrics["environment_steps"]), metrics


def chunk(
    algorithm: Algorithm,
    config: RunConfig,
    budget: Int[Array, ""],
    runs: RunState,
    generations: Int[Array, ""],
) -> tuple[RunState, dict[str, Array], Bool[Array, " seeds"]]:
    """Some generations of every seed.

    Args:
        generations: how many; up to `generations_per_report`.

    Returns:
        The runs after them; their metrics, with axes [seeds, `generations_per_report`], of which rows beyond
        the generations that were lived are 0; and whether there is no NaN in the runs and `ALWAYS_NUMBERS`.
    """
    # Traced once, for its shapes and for the loop.
    one = jax.jit(lambda run: one_generation(algorithm, config, budget, run))

    def of_seed(run: RunState) -> tuple[RunState, dict[str, Array], Bool[Array, ""]]:
        row = jax.eval_shape(one, run)[1]
        rows = jax.tree.map(
            lambda leaf: jnp.zeros((config.generations_per_report, *leaf.shape), leaf.dtype), row
        )

        def live(index: Array, carry: tuple[RunState, PyTree]) -> tuple[RunState, PyTree]:
            run, measured = one(carry[0])
            return run, jax.tree.map(lambda all, new: all.at[index].set(new), carry[1], measured)

        run, rows = jax.lax.fori_loop(0, generations, live, (run, rows))
        return run, rows, is_sound((run, {name: rows[name] for name in ALWAYS_NUMBERS}))

    return jax.vmap(of_seed)(runs)


def is_sound(numbers: PyTree) -> Bool[Array, ""]:
    """Whether no number is NaN. Infinity stands for "none yet" in many a state."""
    leaves = [leaf for leaf in jax.tree.leaves(numbers) if jnp.issubdtype(leaf.dtype, jnp.floating)]
    # By columns first, as bytes: half the time of asking for any. The highest of the numbers themselves need
    # not be NaN if one of them is: XLA's maximum passes over it.
    columns = [
        jnp.isnan(leaf).astype(jnp.uint8).max(axis=tuple(range(leaf.ndim - 1)), initial=0) for leaf in leaves
    ]
    return jnp.stack([jnp.ones((), bool), *(~column.any() for column in columns)]).all()


class CompiledChunk:
    """`chunk` as a program for such runs, of all generations up to a report if it is not told how many.

    Its input is donated, so that the buffer is updated in place. The budget is no part of the program: a run
    that goes on beyond it need not be compiled again where JAX keeps what it has compiled.
    """

    def __init__(self, algorithm: Algorithm, config: RunConfig, runs: RunState):
        self._budget = jnp.asarray(config.steps, jnp.int32)
        self._all = config.generations_per_report
        self._program = compiled(
            lambda runs, budget, generations: chunk(algorithm, config, budget, runs, generations),
            runs,
            self._budget,
            np.int32(self._all),
            donate_argnums=0,
        )

    def __call__(
        self, runs: RunState, generations: int | None = None
    ) -> tuple[RunState, dict[str, Array], Bool[Array, " seeds"]]:
        return self._program(runs, self._budget, np.int32(generations or self._all))


def compiled(function: Callable[..., Any], *arguments: PyTree, **options: Any) -> jax.stages.Compiled:
    """A function compiled for such arguments; on a CPU at LLVM's first level, if `XLA_FLAGS` names none.

    Raises:
        UserError: it would take more memory than there is, as XLA has laid it out.
    """
    traced = jax.jit(function, **options).lower(*arguments)
    ours = jax.default_backend() == "cpu" and OPTIMIZATION_LEVEL not in os.environ.get("XLA_FLAGS", "")
    program = traced.compile({OPTIMIZATION_LEVEL: "1"} if ours else None)
    if laid_out := program.memory_analysis():
        device_memory.check(laid_out.temp_size_in_bytes)
    return program


def play(algorithm: Algorithm, team: Team, key: Key[Array, ""], episodes: int) -> Trajectories:
    """A team's episodes without exploration noise, in worlds drawn from `key`."""
    key_start, key_rollout = jax.random.split(key)
    start = Start.draw(algorithm.env, key_start, episodes)
    return rollout(algorithm.env, Lineup.of_team(team, start), key_rollout)[1]


def with_other_keys(runs: PyTree, number: int) -> PyTree:
    """The same runs, that draw other random numbers from here on."""

    def other(leaf: Array) -> Array:
        if not jax.dtypes.issubdtype(leaf.dtype, jax.dtypes.prng_key):
            return leaf
        return jax.vmap(lambda key: jax.random.fold_in(key, number))(leaf.ravel()).reshape(leaf.shape)

    return jax.tree.map(other, runs)


def flat_arrays(state: PyTree) -> dict[str, Array]:
    """A state as named plain arrays, for files: typed keys become their numbers."""
    leaves, _ = jax.tree_util.tree_flatten_with_path(state)
    return {jax.tree_util.keystr(path): _key_numbers(leaf) for path, leaf in leaves}


def from_flat_arrays(arrays: dict[str, Any], like: PyTree, part: str = "") -> PyTree:
    """The inverse of `flat_arrays`.

    Args:
        like: has the structure, as arrays or shapes.
        part: the one field that is wanted, such as ".team" or ".algorithm.key"; by default all of it.
    """
    like = operator.attrgetter(part[1:])(like) if part else like
    leaves, structure = jax.tree_util.tree_flatten_with_path(like)
    restored = []
    for path, leaf in leaves:
        array = jnp.asarray(arrays[part + jax.tree_util.keystr(path)])
        is_key = jax.dtypes.issubdtype(leaf.dtype, jax.dtypes.prng_key)
        restored.append(jax.random.wrap_key_data(array) if is_key else array)
    return jax.tree_util.tree_unflatten(structure, restored)


def shapes(algorithm: Algorithm, config: RunConfig) -> RunState:
    """Shapes of the whole run's state, without making it."""
    return jax.eval_shape(
        lambda seeds: jax.vmap(lambda seed: initial_state(algorithm, seed))(seeds), seeds_of(config)
    )


def seeds_of(config: RunConfig) -> UInt32[Array, " seeds"]:
    """The seeds as an array."""
    return jnp.asarray(config.seeds, jnp.uint32)


def _strongly_typed(leaf: Array) -> Array:
    return leaf if jax.dtypes.issubdtype(leaf.dtype, jax.dtypes.prng_key) else leaf.astype(leaf.dtype)


def _key_numbers(leaf: Array) -> Array:
    return jax.random.key_data(leaf) if jax.dtypes.issubdtype(leaf.dtype, jax.dtypes.prng_key) else leaf
