"""Evolution strategies of evosax as evolvers: which way they climb, and what they do with equals."""

import functools
import sys
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from oracles.refusals import refusal, unhooked
from skillcrew.evolution import evosax_bridge
from skillcrew.evolution.evolver import Evolver
from skillcrew.evolution.evosax_bridge import (
    EVOSAX_NAMES,
    FULL_COVARIANCE_GENES,
    EvosaxConfig,
    EvosaxStrategy,
    ordered_weights,
    shared_weights,
)
from skillcrew.evolution.strategy import EvolutionStrategy, StrategyConfig
from skillcrew.experiment.checkpoints import Checkpoints
from skillcrew.experiment.generation import flat_arrays

POPULATION, GENES, GENERATIONS = 12, 5, 4
CONFIG = EvosaxConfig(deviation=0.3, learning_rate=0.05, fitness_memory=3.0)
TARGET = np.array([1.0, -2.0, 0.5, 3.0, -0.25], np.float32)

each = pytest.mark.parametrize("name", EVOSAX_NAMES)
loaded = unhooked(evosax_bridge)


def draw(key, population: int):
    return 3 * jax.random.normal(key, (population, GENES))


@functools.cache
def compiled(name: Any) -> tuple[EvosaxStrategy, Any, Any]:
    """An evolver, and its `init` and `next_generation` as programs."""
    evolver = EvosaxStrategy(name, CONFIG, draw, POPULATION)
    return evolver, jax.jit(lambda key: evolver.init(key, POPULATION)), jax.jit(evolver.next_generation)


def fitnesses(seed: int = 0) -> np.ndarray:
    """Of each generation; with few values, so that many individuals are equals."""
    return np.random.default_rng(seed).integers(0, 5, (GENERATIONS, POPULATION)).astype(np.float32) / 4


def advance(name: Any, state: Any, fitness: np.ndarray, generation: int = 0) -> Any:
    evaluations = jnp.ones(POPULATION)
    return compiled(name)[2](jax.random.key(100 + generation), state, jnp.asarray(fitness), evaluations)


def first(name: Any) -> Any:
    return compiled(name)[1](jax.random.key(0))


@each
def test_it_climbs_to_the_largest_fitness(name) -> None:
    evolver, init, step = compiled(name)
    assert isinstance(evolver, Evolver)
    state = init(jax.random.key(2))
    distances, known = [], []
    for generation in range(500):
        fitness = -((np.asarray(evolver.genomes(state)) - TARGET) ** 2).sum(1)
        state = step(jax.random.key(generation), state, jnp.asarray(fitness), jnp.ones(POPULATION))
        distances.append(float(jnp.linalg.norm(evolver.champion(state) - TARGET)))
        known.append(float(evolver.champion_fitness(state)))
    assert distances[0] > 3
    # Those that adapt σ have long found the optimum, and must not end as 0 / 0 there.
    assert max(distances[-50:]) < (0.5 if name == "open_es" else 0.01)
    # It is told how good the population is, not how bad.
    assert known[0] < -9
    assert known[-1] == pytest.approx(0, abs=2 * GENES * CONFIG.deviation**2)


@each
def test_seeds_side_by_side_are_the_seeds_one_by_one(name) -> None:
    evolver, init, step = compiled(name)
    keys = jax.random.split(jax.random.key(4), 3)
    together = jax.jit(jax.vmap(lambda key: evolver.init(key, POPULATION)))(keys)
    steps = jax.jit(jax.vmap(evolver.next_generation, in_axes=(0, 0, None, None)))
    alone = [init(key) for key in keys]
    lived = []
    for fitness in jnp.asarray(fitnesses()):
        together = steps(keys, together, fitness, jnp.ones(POPULATION))
        alone = [
            step(key, state, fitness, jnp.ones(POPULATION)) for key, state in zip(keys, alone, strict=True)
        ]
        lived.append(together.population)
        keys = jax.vmap(lambda key: jax.random.fold_in(key, 1))(keys)
    for seed, own in enumerate(alone):
        theirs = jax.tree.map(lambda leaf, seed=seed: leaf[seed], together)
        jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, rtol=2e-4, atol=1e-5), theirs, own)
    # Generations and seeds have noise of their own.
    assert len(np.unique(lived)) == np.size(lived)


@each
def test_the_state_can_be_donated_saved_and_scanned(name, tmp_path) -> None:
    evolver, state = compiled(name)[0], first(name)
    for begun in (state, evolver.init(jax.random.key(0), POPULATION)):
        leaves = jax.tree.leaves(begun)
        assert all(isinstance(leaf, jax.Array) and leaf.size for leaf in leaves)
        assert not any(np.isnan(leaf).any() for leaf in leaves)
        assert len({leaf.unsafe_buffer_pointer() for leaf in leaves}) == len(leaves)

    checkpoints = Checkpoints(tmp_path / "checkpoints")
    checkpoints.save(1, state, 0.5)
    arrays, _ = checkpoints.read(state)
    jax.tree.map(np.testing.assert_array_equal, arrays, flat_arrays(state))

    after = jax.eval_shape(evolver.next_generation, jax.random.key(1), state, jnp.zeros(POPULATION))
    assert jax.tree.map(kind_of, after) == jax.tree.map(kind_of, state)


def kind_of(leaf: Any) -> tuple[Any, ...]:
    return leaf.shape, leaf.dtype, leaf.weak_type


@each
def test_the_first_mean_is_drawn_and_the_population_spread_around_it(name) -> None:
    evolver, init, _ = compiled(name)
    state = first(name)
    drawn = draw(jax.random.split(jax.random.key(0), 3)[0], 1)[0]
    np.testing.assert_allclose(evolver.champion(state), drawn, rtol=1e-6)
    assert float(evolver.champion_fitness(state)) == 0
    begun = [init(jax.random.key(seed)) for seed in range(40)]
    steps = np.stack([evolver.genomes(state) - evolver.champion(state)[None] for state in begun])
    assert steps.shape == (40, POPULATION, GENES)
    np.testing.assert_allclose(steps.std((0, 1)), CONFIG.deviation, rtol=0.15)
    np.testing.assert_allclose(steps.mean((0, 1)), 0, atol=0.05)


@each
def test_the_champion_is_the_mean_and_its_fitness_a_running_average(name) -> None:
    evolver, state, known = compiled(name)[0], first(name), 0.0
    for time, fitness in enumerate(fitnesses()):
        before = np.asarray(evolver.champion(state))
        state = advance(name, state, fitness, time)
        # Full after three generations; from then on the latest weighs a third.
        weight = 1 / min(time + 1, 3)
        known = (1 - weight) * known + weight * fitness.mean()
        assert float(evolver.champion_fitness(state)) == pytest.approx(known, rel=1e-5)
        np.testing.assert_array_equal(evolver.champion(state), state.distribution.mean)
        assert not np.array_equal(evolver.champion(state), before)
        # Nobody in the population is it.
        assert not (np.asarray(state.population) == np.asarray(evolver.champion(state))).all(1).any()
        np.testing.assert_array_equal(evolver.standing(state, jnp.asarray(fitness)), fitness)


@each
@pytest.mark.parametrize("transform", [lambda f: 7 * f - 3, lambda f: np.exp(5 * f)], ids=["affine", "exp"])
def test_the_step_depends_on_the_order_of_fitness_alone(name, transform) -> None:
    one = other = first(name)
    for time, fitness in enumerate(fitnesses(3)):
        one = advance(name, one, fitness, time)
        other = advance(name, other, transform(fitness).astype(np.float32), time)
    np.testing.assert_array_equal(one.population, other.population)


# Equals, of which a sparse reward has many


def test_equals_share_their_weights_or_take_them_in_order() -> None:
    loss = jnp.array([0.5, 0.1, 0.5, 0.9, 0.1, 0.5])
    weights = jnp.array([0.6, 0.4, 0.1, 0.0, -0.3, -0.8])
    shared = [-0.2 / 3, 0.5, -0.2 / 3, -0.8, 0.5, -0.2 / 3]
    np.testing.assert_allclose(shared_weights(loss, weights), shared, atol=1e-6)
    np.testing.assert_allclose(ordered_weights(loss, weights), [0.1, 0.6, 0.0, -0.8, 0.4, -0.3], atol=1e-6)


@each
def test_where_all_are_equal_there_is_no_step_and_no_collapse(name) -> None:
    """With evosax' own weights for equals, 200 such generations took σ of CMA-ES from 0.1 to 2e-10."""
    evolver, state = compiled(name)[0], first(name)
    begun = np.asarray(evolver.champion(state))
    for generation in range(60):
        state = advance(name, state, np.full(POPULATION, 0.4), generation)
    # The step size of so few genes walks at random; collapsing it would be below 1e-6 by now.
    assert 0.1 < float(jnp.mean(state.distribution.std)) / CONFIG.deviation < 10
    if name in ("open_es", "snes"):
        np.testing.assert_allclose(evolver.champion(state), begun, atol=1e-5)


# Where we differ from evosax' defaults, or do the same as our own


def test_sep_cma_es_learns_the_scales_of_genes_in_time() -> None:
    """With the full matrix's learning rates it is at -2.9e3 by then."""
    genes = 60
    scale = jnp.logspace(0, 4, genes)
    evolver = EvosaxStrategy("sep_cma_es", CONFIG, lambda key, n: jnp.ones((n, genes)), POPULATION)

    def generation(state, key):
        fitness = -(evolver.genomes(state) ** 2 * scale[None]).sum(1)
        return evolver.next_generation(key, state, fitness), fitness.mean()

    @jax.jit
    def climb(key):
        return jax.lax.scan(generation, evolver.init(key, POPULATION), jax.random.split(key, 600))[1]

    fitness = climb(jax.random.key(6))
    assert float(fitness[0]) < -1e4
    assert float(fitness[-1]) > -1


def test_open_es_steps_as_our_own_strategy_does() -> None:
    config = StrategyConfig(deviation=CONFIG.deviation, learning_rate=CONFIG.learning_rate, patience=0)
    strategy = EvolutionStrategy(config, draw)
    theirs, ours = first("open_es"), strategy.init(jax.random.key(7), POPULATION)
    ours = ours.__class__(**{**vars(ours), "mean": theirs.distribution.mean})
    step = jax.jit(strategy.next_generation)
    for time, fitness in enumerate(fitnesses()):
        half = theirs.population[: POPULATION // 2]
        noise = (half - theirs.distribution.mean[None]) / CONFIG.deviation
        ours = ours.__class__(**{**vars(ours), "noise": noise})
        np.testing.assert_allclose(strategy.genomes(ours), theirs.population, rtol=1e-5, atol=1e-5)
        ours = step(jax.random.key(time), ours, jnp.asarray(fitness))
        theirs = advance("open_es", theirs, fitness, time)
        np.testing.assert_allclose(ours.mean, theirs.distribution.mean, rtol=1e-4, atol=1e-4)


# Refusals


@each
def test_without_the_package_one_line_says_how_to_get_it(name, monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "evosax", None)
    without = unhooked.__wrapped__(evosax_bridge)
    message = refusal(lambda: without.EvosaxStrategy(name, CONFIG, draw, POPULATION))
    assert f"evolver = {name}" in message
    assert "pip install 'skillcrew[evolution]'" in message


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("deviation", 0.0),
        ("deviation", float("inf")),
        ("learning_rate", -0.5),
        ("learning_rate", float("nan")),
        ("fitness_memory", 0.75),
    ],
)
def test_refuses_a_value_and_names_field_and_value(field: str, value: float) -> None:
    assert f"evosax.{field} = {value}: give" in refusal(loaded.EvosaxConfig, **{field: value})


@pytest.mark.parametrize(
    ("name", "refused", "accepted"),
    [("open_es", (0, 1, 7), 2), ("cma_es", (0, 3), 4), ("sep_cma_es", (1, 3), 5), ("snes", (2,), 4)],
)
def test_populations_too_small_or_odd_are_refused(name, refused, accepted) -> None:
    config = loaded.EvosaxConfig()
    for population in refused:
        message = refusal(config.check_population, population=population, evolver=name)
        assert f"population = {population}: evolver = {name}" in message
        assert "give" in message
    config.check_population(accepted, name)


@pytest.mark.parametrize(("name", "accepted"), [("open_es", 2), ("cma_es", 4)])
def test_the_smallest_population_evolves(name, accepted) -> None:
    evolver = EvosaxStrategy(name, CONFIG, draw, accepted)

    @jax.jit
    def genomes(key):
        state = evolver.next_generation(key, evolver.init(key, accepted), jnp.arange(float(accepted)))
        return evolver.genomes(state)

    assert np.isfinite(genomes(jax.random.key(0))).all()


def test_cma_es_refuses_more_genes_than_it_can_decompose() -> None:
    genes = FULL_COVARIANCE_GENES + 48
    message = refusal(
        lambda: loaded.EvosaxStrategy("cma_es", CONFIG, lambda key, n: jnp.zeros((n, genes)), POPULATION)
    )
    assert "evolver = cma_es: 1048 genes" in message
    assert "4 MiB" in message
    assert "set evolver to sep_cma_es" in message
    EvosaxStrategy("sep_cma_es", CONFIG, lambda key, n: jnp.zeros((n, genes)), POPULATION)
