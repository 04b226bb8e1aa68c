"""The evolution strategy against its equations in NumPy, and what its step may depend on."""

import itertools
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import stats

from skillcrew.evolution.strategy import EvolutionStrategy, StrategyConfig, StrategyState, centred_ranks

POPULATION, GENES, GENERATIONS = 12, 5, 4
CONFIG = StrategyConfig(deviation=0.2, learning_rate=0.05, fitness_memory=3.0, patience=0)


def draw(key, population: int):
    return 3 * jax.random.normal(key, (population, GENES))


STRATEGY = EvolutionStrategy(CONFIG, draw)
next_generation = jax.jit(STRATEGY.next_generation)


@pytest.fixture(scope="module")
def first() -> StrategyState:
    return jax.jit(lambda key: STRATEGY.init(key, POPULATION))(jax.random.key(0))


def fitnesses(seed: int = 0) -> np.ndarray:
    """Of each generation; with few values, so that many individuals are equals."""
    return np.random.default_rng(seed).integers(0, 5, (GENERATIONS, POPULATION)).astype(np.float32) / 4


def advance(state: StrategyState, fitness: np.ndarray, generation: int = 0) -> StrategyState:
    evaluations = jnp.full(POPULATION, 3.0)
    return next_generation(jax.random.key(100 + generation), state, jnp.asarray(fitness), evaluations)


def test_the_mean_steps_by_adam_up_the_gradient_of_the_rank(first) -> None:
    mean, state = np.asarray(first.mean, np.float64), first
    momentum, square = np.zeros(GENES), np.zeros(GENES)
    for time, fitness in enumerate(fitnesses(), start=1):
        # Equals share the mean of their ranks; the worst rank is -1/2, the best 1/2.
        rank = (stats.rankdata(fitness, method="average") - 1) / (POPULATION - 1) - 0.5
        noise = (np.asarray(STRATEGY.genomes(state), np.float64) - np.asarray(state.mean)) / CONFIG.deviation
        gradient = rank @ noise / (POPULATION * CONFIG.deviation)
        momentum = 0.9 * momentum + 0.1 * gradient
        square = 0.999 * square + 0.001 * gradient**2
        scaled = momentum / (1 - 0.9**time) / (np.sqrt(square / (1 - 0.999**time)) + 1e-8)
        mean = mean + CONFIG.learning_rate * scaled
        state = advance(state, fitness, time)
        np.testing.assert_allclose(state.mean, mean, rtol=1e-4, atol=1e-5)


def test_ranks_of_equals_are_the_mean_of_theirs() -> None:
    ranks = centred_ranks(jnp.array([0.2, 0.9, 0.2, 0.0, 0.9, 0.9]))
    np.testing.assert_allclose(ranks, [-0.2, 0.3, -0.2, -0.5, 0.3, 0.3], atol=1e-6)


def test_genomes_are_mirrored_around_the_mean_at_the_stated_distance() -> None:
    wide = EvolutionStrategy(StrategyConfig(deviation=0.25), lambda key, count: jnp.full((count, 700), 5.0))
    state = wide.init(jax.random.key(1), 40)
    genomes = np.asarray(wide.genomes(state))
    assert genomes.shape == (40, 700)
    np.testing.assert_allclose((genomes[:20] + genomes[20:]) / 2, 5.0, atol=1e-5)
    noise = genomes[:20] - 5
    assert noise.std() == pytest.approx(0.25, rel=0.02)
    assert noise.mean() == pytest.approx(0, abs=0.01)
    assert len(np.unique(noise)) > 0.9 * noise.size


def test_each_generation_has_noise_of_its_own_and_begins_at_a_drawn_mean(first) -> None:
    np.testing.assert_array_equal(first.mean, draw(jax.random.split(jax.random.key(0))[0], 1)[0])
    one, other = advance(first, fitnesses()[0], 0), advance(first, fitnesses()[0], 1)
    assert not np.isin(np.asarray(one.noise), np.asarray(first.noise)).any()
    assert not np.isin(np.asarray(one.noise), np.asarray(other.noise)).any()


def test_the_champion_is_the_mean_and_its_fitness_a_running_average(first) -> None:
    state, known, told = first, 0.0, fitnesses()
    for time, fitness in enumerate(told):
        state = advance(state, fitness, time)
        # Full after three generations; from then on the latest weighs a third.
        weight = 1 / min(time + 1, 3)
        known = (1 - weight) * known + weight * fitness.mean()
        assert float(STRATEGY.champion_fitness(state)) == pytest.approx(known, rel=1e-5)
        np.testing.assert_array_equal(STRATEGY.champion(state), state.mean)


@pytest.mark.parametrize(
    "transform",
    [lambda f: 7 * f - 3, lambda f: np.exp(5 * f), lambda f: -1 / (f + 0.1)],
    ids=["affine", "exponential", "inverse"],
)
def test_the_step_depends_on_the_order_of_fitness_alone(first, transform) -> None:
    one = other = first
    for time, fitness in enumerate(fitnesses(3)):
        one, other = advance(one, fitness, time), advance(other, transform(fitness).astype(np.float32), time)
    np.testing.assert_array_equal(one.mean, other.mean)
    assert not np.array_equal(one.mean, first.mean)


def test_where_all_are_equal_the_mean_stays(first) -> None:
    np.testing.assert_array_equal(advance(first, np.full(POPULATION, 0.4)).mean, first.mean)


@pytest.mark.parametrize("below", [None, 0.4])
def test_it_climbs_to_the_optimum_of_a_known_function(below: float | None) -> None:
    """Patient for a tenth of the way: a fitness that is never above 0 is no reason to begin anew."""
    target = jnp.array([1.0, -2.0, 0.5, 3.0, -0.25])
    strategy = EvolutionStrategy(StrategyConfig(deviation=0.1, learning_rate=0.05, restart_below=below), draw)
    assert strategy.config.patience == 40

    def generation(state: StrategyState, key) -> tuple[StrategyState, Any]:
        fitness = -((strategy.genomes(state) - target[None]) ** 2).sum(1)
        state = strategy.next_generation(key, state, fitness)
        return state, jnp.linalg.norm(strategy.champion(state) - target)

    @jax.jit
    def climb(key):
        return jax.lax.scan(generation, strategy.init(key, 24), jax.random.split(key, 400))[1]

    distance = climb(jax.random.key(2))
    assert float(distance[0]) > 3
    assert float(distance[-50:].max()) < 0.25


def test_an_individual_stands_by_its_own_fitness(first) -> None:
    fitness = jnp.asarray(fitnesses()[0])
    np.testing.assert_array_equal(STRATEGY.standing(first, fitness), fitness)


# Beginning anew


RESTARTING = EvolutionStrategy(
    StrategyConfig(fitness_memory=1.0, patience=3, tolerance=0.05, restart_below=0.4), draw
)
told = jax.jit(RESTARTING.next_generation)


def tell(state: StrategyState, *means: float) -> list[StrategyState]:
    """The states after generations of such mean fitness, with individuals that differ."""
    spread = np.linspace(-0.01, 0.01, POPULATION).astype(np.float32)
    states = []
    for generation, mean in enumerate(means):
        fitness = jnp.asarray(np.float32(mean) + spread)
        state = told(jax.random.key(50 + generation), state, fitness, jnp.ones(POPULATION))
        states.append(state)
    return states


def jumps(states: list[StrategyState], first: StrategyState) -> list[bool]:
    """Where the mean moved further than a step."""
    means = [np.asarray(state.mean) for state in (first, *states)]
    return [bool(np.abs(after - before).max() > 0.1) for before, after in itertools.pairwise(means)]


def test_a_search_that_stalls_begins_anew_where_it_is_drawn(first) -> None:
    # Two improvements beyond the tolerance, one below it, and waiting: the third in vain ends it.
    states = tell(first, 0.1, 0.2, 0.22, 0.2, 0.2, 0.1)
    assert jumps(states, first) == [False, False, False, False, True, False]
    anew = states[4]
    key = jax.random.split(jax.random.key(54))[1]
    np.testing.assert_allclose(anew.mean, draw(key, 1)[0], rtol=1e-6)
    assert all(not leaf.any() for leaf in jax.tree.leaves(anew.optimiser))
    # It is as patient as the first.
    assert int(states[5].progress.waited) == 0


def test_what_was_given_up_stays_the_champion_until_it_is_surpassed(first) -> None:
    states = tell(first, 0.3, 0.3, 0.3, 0.3, 0.1, 0.2, 0.35)
    assert jumps(states, first) == [False, False, False, True, False, False, False]
    given_up = np.asarray(states[3].progress.kept)
    # The mean of the last generation before, with the step that its fitness made.
    assert np.abs(given_up - np.asarray(states[2].mean)).max() < 0.1
    for state in states[3:6]:
        np.testing.assert_array_equal(RESTARTING.champion(state), given_up)
        assert float(RESTARTING.champion_fitness(state)) == pytest.approx(0.3, abs=1e-6)
    np.testing.assert_array_equal(RESTARTING.champion(states[6]), states[6].mean)


def test_a_worse_search_given_up_does_not_replace_the_kept_one(first) -> None:
    states = tell(first, 0.3, 0.3, 0.3, 0.3, *[0.1] * 4)
    assert jumps(states, first) == [False, False, False, True, False, False, False, True]
    np.testing.assert_array_equal(states[-1].progress.kept, states[3].progress.kept)
    assert float(states[-1].progress.kept_fitness) == pytest.approx(0.3, abs=1e-6)


def test_a_good_search_never_begins_anew(first) -> None:
    assert not any(jumps(tell(first, *[0.45] * 8), first))


def test_on_negative_returns_it_begins_anew_only_while_nothing_changes() -> None:
    free = EvolutionStrategy(StrategyConfig(fitness_memory=1.0, patience=3, tolerance=0.05), draw)
    step = jax.jit(free.next_generation)
    state = first = free.init(jax.random.key(0), POPULATION)
    champions, fitness = [], []
    for generation, mean in enumerate([*[-15.0] * 4, -20.0, -20.0, *[-10.0] * 12]):
        state = step(jax.random.key(80 + generation), state, jnp.full(POPULATION, mean))
        champions.append(np.asarray(free.champion(state)))
        fitness.append(float(free.champion_fitness(state)))
    assert fitness == [-15.0] * 6 + [-10.0] * 12
    # Where all are equal a mean stays where it is.
    for champion in champions[:6]:
        np.testing.assert_array_equal(champion, first.mean)
    for champion in champions[6:]:
        np.testing.assert_array_equal(champion, state.mean)


def test_without_patience_no_search_begins_anew(first) -> None:
    states, state = [], first
    for generation in range(8):
        state = advance(state, fitnesses()[0] * 0.1, generation)
        states.append(state)
    assert not any(jumps(states, first))
