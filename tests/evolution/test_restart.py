"""A genetic search that stalls low begins anew, and keeps the best that it gave up."""

import dataclasses
import functools
from collections.abc import Callable, Sequence

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from skillcrew.errors import UserError
from skillcrew.evolution.coevolution import CoevolutionConfig
from skillcrew.evolution.genetic import EvolutionConfig, GeneticAlgorithm, GeneticState
from skillcrew.evolution.mutation import MutationConfig
from skillcrew.evolution.restart import Progress, RestartConfig
from skillcrew.evolution.strategy import LOW_AVERAGE

POPULATION, GENES = 9, 4
# Without priors a champion's fitness is what its lineage was told.
CONFIG = EvolutionConfig(
    elites=2,
    lineage_memory=1.0,
    lineage_prior=0.0,
    champion_prior=0.0,
    mutation=MutationConfig(probability=0.0),
    restart=RestartConfig(patience=3, below=0.4, tolerance=0.05),
)


def draw(key, population: int):
    return jax.random.normal(key, (population, GENES))


GENETIC = GeneticAlgorithm(CONFIG, draw)


def patient(generations: int) -> GeneticAlgorithm:
    restart = dataclasses.replace(CONFIG.restart, patience=generations)
    return GeneticAlgorithm(dataclasses.replace(CONFIG, restart=restart), draw)


PLAIN = patient(0)
told = jax.jit(GENETIC.next_generation)
FIRST = GENETIC.init(jax.random.key(0), POPULATION)


def key_of(generation: int):
    return jax.random.key(70 + generation)


def tell(*best: float) -> list[GeneticState]:
    """The states after generations in which the first one has this fitness and the others half of it."""
    state, states = FIRST, []
    for generation, fitness in enumerate(best):
        of_all = jnp.full(POPULATION, fitness / 2, jnp.float32).at[0].set(fitness)
        state = told(key_of(generation), state, of_all)
        states.append(state)
    return states


def begun_anew(states: list[GeneticState]) -> list[bool]:
    """Where the whole population is one that was drawn, of which nothing is known."""
    fresh = [draw(jax.random.split(key_of(generation))[1], POPULATION) for generation in range(len(states))]
    same = [bool(jnp.allclose(state.genomes, drawn)) for state, drawn in zip(states, fresh, strict=True)]
    for anew, state in zip(same, states, strict=True):
        assert anew == (not state.lineage.evaluations.any())
    return same


def test_it_begins_anew_after_waiting_in_vain() -> None:
    # Two improvements beyond the tolerance, one below it; the third generation in vain ends the search.
    states = tell(0.1, 0.2, 0.22, 0.2, 0.2, 0.1, 0.1)
    assert begun_anew(states) == [False, False, False, False, True, False, False]
    # The new search is as patient as the first.
    assert int(states[5].progress.waited) == 0


def test_what_was_given_up_is_reported_until_it_is_surpassed() -> None:
    states = tell(0.3, 0.3, 0.3, 0.3, 0.1, 0.2, 0.35)
    assert begun_anew(states) == [False, False, False, True, False, False, False]
    given_up = np.asarray(FIRST.genomes[0])
    for state in states[:6]:
        np.testing.assert_array_equal(GENETIC.champion(state), given_up)
        assert float(GENETIC.champion_fitness(state)) == pytest.approx(0.3, abs=1e-6)
    np.testing.assert_array_equal(GENETIC.champion(states[6]), states[6].genomes[0])
    assert float(GENETIC.champion_fitness(states[6])) == pytest.approx(0.35, abs=1e-6)


def test_a_worse_search_does_not_replace_the_kept_one() -> None:
    states = tell(*[0.3] * 4, *[0.1] * 4)
    assert begun_anew(states) == [False] * 3 + [True] + [False] * 3 + [True]
    np.testing.assert_array_equal(GENETIC.champion(states[-1]), FIRST.genomes[0])


def test_a_good_search_goes_on() -> None:
    assert not any(begun_anew(tell(*[0.45] * 8)))


def test_a_lucky_newcomer_is_no_improvement() -> None:
    """The fitness that counts is the surest individual's, drawn to the population's mean by its prior."""
    wary = GeneticAlgorithm(dataclasses.replace(CONFIG, champion_prior=20.0), draw)
    fitness = jnp.full(POPULATION, 0.1).at[3].set(1.0)
    after = jax.jit(wary.next_generation)(key_of(0), FIRST, fitness)
    mean = float(fitness.mean())
    assert float(after.progress.fitness) == pytest.approx((1.0 + 20 * mean) / 21, rel=1e-5)


def test_without_patience_nothing_begins_anew_and_no_number_changes() -> None:
    state, before, plain = FIRST, None, jax.jit(PLAIN.next_generation)
    for generation in range(8):
        before, state = state, plain(key_of(generation), state, jnp.full(POPULATION, 0.1))
        assert state.lineage.evaluations.any()
    assert int(state.progress.waited) == 7
    key = jax.random.key(3)
    fitness = jnp.linspace(0, 1, POPULATION)
    same = plain(jax.random.split(key)[0], before, fitness)
    wary = jax.jit(patient(100).next_generation)(key, before, fitness)
    np.testing.assert_array_equal(wary.genomes, same.genomes)


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"patience": -1}, ["restart.patience = -1", "0 for no restarts"]),
        ({"tolerance": -0.1}, ["restart.tolerance = -0.1", "at least 0"]),
        ({"tolerance": float("nan")}, ["restart.tolerance = nan"]),
        ({"below": float("nan")}, ["restart.below = nan", "give a fitness"]),
    ],
)
def test_impossible_restarts_are_refused(fields, said) -> None:
    with pytest.raises(UserError) as refused:
        RestartConfig(**fields)
    assert all(part in str(refused.value) for part in said)


def test_coevolution_refuses_them_by_name() -> None:
    with pytest.raises(UserError, match=r"evolution\.restart\.patience = 3: .*coevolution.*set it to 0"):
        CoevolutionConfig().check_population(40, CONFIG)


# Without a level, on whatever scale


FREE = RestartConfig(patience=3, tolerance=0.05)


def follow(
    config: RestartConfig, *fitness: float, spread: float = 0.0, others: Sequence[float] | None = None
) -> tuple[list[int], Progress]:
    """The generations after which searches of such a fitness begin anew, and what is known in the end.

    The champion of generation i is a genome of is.

    Args:
        others: what the individuals were told; by default values of this spread.
    """
    anew, progress = [], Progress.create(jnp.full(GENES, -1.0), config)
    for generation, value in enumerate(fitness):
        of_all = value + spread * np.linspace(-0.5, 0.5, 5) if others is None else others
        genome = np.full(GENES, generation, np.float32)
        told = np.float32(value), np.asarray(of_all, np.float32)
        stalled, progress, begun = one_generation(config)(progress, *told, genome)
        if stalled:
            anew.append(generation)
            progress = begun
    return anew, progress


@functools.cache
def one_generation(config: RestartConfig) -> Callable[..., tuple]:
    """Whether the search has stalled after a generation, its progress, and that of a search begun anew."""

    @jax.jit
    def told(progress, value, of_all, genome):
        progress = progress.observe(value, of_all, config)
        return progress.stalled(config), progress, progress.begin_anew(genome, config)

    return told


@pytest.mark.parametrize("level", [-15.0, 0.0, 2000.0])
def test_a_search_that_never_improved_begins_anew_wherever_its_fitness_is(level: float) -> None:
    anew, progress = follow(FREE, *[level] * 12)
    assert anew == [3, 7, 11]
    assert float(progress.kept_fitness) == level
    # Equals do not replace the first.
    np.testing.assert_array_equal(progress.kept, np.full(GENES, 3.0))


def test_one_that_improved_never_does_even_where_it_is_negative() -> None:
    assert follow(FREE, -15.0, -14.0, *[-14.5] * 40)[0] == []
    # Rounding of an average is no improvement, and so is less than the tolerance's share of the spread.
    assert follow(FREE, -15.0, -15.0 + 2e-6, -15.0, -15.0)[0] == [3]
    assert follow(FREE, -15.0, -14.6, -14.6, -14.6, spread=10.0)[0] == [3]
    assert follow(FREE, -15.0, -14.4, *[-15.0] * 9, spread=10.0)[0] == []


@pytest.mark.parametrize(("times", "plus"), [(128.0, 0.0), (0.0078125, 0.0), (4.0, -50.0), (1.0, 1024.0)])
def test_when_it_begins_anew_does_not_depend_on_the_scale(times: float, plus: float) -> None:
    rng = np.random.default_rng(5)
    whens = set()
    for _ in range(30):
        fitness = rng.integers(0, 3, 16) / 64
        expected, progress = follow(FREE, *fitness, spread=0.5)
        whens.add(tuple(expected))
        found, scaled = follow(FREE, *(times * fitness + plus), spread=times * 0.5)
        assert found == expected
        np.testing.assert_array_equal(scaled.kept, progress.kept)
    assert len(whens) > 3


def test_the_champion_is_the_best_that_is_known_where_all_are_negative() -> None:
    _, progress = follow(FREE, *[-15.0] * 4, *[-20.0] * 2)
    given_up, current = np.full(GENES, 3.0), jnp.full(GENES, 99.0)
    np.testing.assert_array_equal(progress.champion(current), given_up)
    # Also in the generation in which the search begins, when nothing is known of the new one.
    _, begun = follow(FREE, *[-15.0] * 4)
    np.testing.assert_array_equal(begun.champion(current), given_up)
    better = progress.observe(jnp.float32(-10.0), jnp.full(POPULATION, -10.0), FREE)
    np.testing.assert_array_equal(better.champion(current), current)


def test_a_level_is_one_on_a_scale_of_successes_or_whatever_the_user_means() -> None:
    level = RestartConfig(patience=3, below=0.4, tolerance=0.05)
    # Negative fitness is not on that scale: nothing says that it is low.
    assert follow(level, *[-15.0] * 40)[0] == []
    assert follow(level, 0.2, -0.1, *[0.1] * 40)[0] == []
    # Nothing achieved is no improvement.
    assert follow(level, 0.0, 0.0, 0.0)[0] == [2]
    # A level below 0 is one that somebody gave, who knows the scale.
    own = RestartConfig(patience=3, below=-20.0, tolerance=0.05)
    assert follow(own, *[-30.0] * 5)[0] == [3]
    assert follow(own, *[-10.0] * 40)[0] == []


def test_a_genetic_search_on_negative_returns_finds_its_way() -> None:
    """Where nothing changes it begins anew; where it does, it goes on."""
    genetic = GeneticAlgorithm(dataclasses.replace(CONFIG, restart=FREE), draw)
    step = jax.jit(genetic.next_generation)
    state = genetic.init(jax.random.key(0), POPULATION)
    champion = np.asarray(state.genomes[0])
    for generation in range(4):
        state = step(key_of(generation), state, jnp.full(POPULATION, -15.0))
    assert not state.lineage.evaluations.any()
    np.testing.assert_array_equal(genetic.champion(state), champion)
    assert float(genetic.champion_fitness(state)) == -15.0
    for generation in range(4, 16):
        state = step(key_of(generation), state, jnp.full(POPULATION, -14.0 + 0.5 * (generation > 5)))
    assert state.lineage.evaluations.any() and int(state.progress.waited) > CONFIG.restart.patience
    np.testing.assert_array_equal(genetic.champion(state), state.genomes[0])


# Where most get nothing at all


NOTHING, SOME = [0.0, 0.0, 0.0, 1.0], [0.0, 0.5, 0.5, 1.0]


@pytest.mark.parametrize(("times", "plus"), [(1.0, 0.0), (256.0, 0.0), (0.5, -64.0)])
def test_one_that_improved_begins_anew_where_half_mostly_get_the_least_of_all(times, plus) -> None:
    def when(config: RestartConfig, fitness: list[float], others: list[float]) -> list[int]:
        scaled = [times * value + plus for value in others]
        return follow(config, *(times * value + plus for value in fitness), others=scaled)[0]

    improved = [0.0, 0.25, *[0.25] * 7]
    assert when(FREE, improved, NOTHING) == [4, 8]
    assert when(FREE, improved, SOME) == []
    # It is not low any more.
    assert when(FREE, [0.0, 0.75, *[0.75] * 7], NOTHING) == [4, 8]
    assert when(FREE, [0.0, 0.875, *[0.875] * 7], NOTHING) == []


def test_the_least_of_all_is_that_of_earlier_searches_too() -> None:
    progress = Progress.create(jnp.zeros(GENES), FREE)
    for value, others in ((0.0, [-4.0, 0.0, 0.0]), (1.0, [0.0, 0.0, 1.0]), *[(0.5, [0.0, 0.0, 1.0])] * 4):
        progress = progress.observe(jnp.float32(value), jnp.asarray(others), FREE)
        assert not progress.stalled(FREE)
    begun = progress.begin_anew(jnp.zeros(GENES), FREE)
    assert (float(begun.least), float(begun.most), int(begun.idle)) == (-4.0, 1.0, 0)


def test_less_than_half_of_the_generations_are_not_most() -> None:
    progress = Progress.create(jnp.zeros(GENES), FREE)
    said = []
    for generation in range(12):
        others = NOTHING if generation % 3 == 0 else SOME
        progress = progress.observe(jnp.float32(0.25 * (generation > 0)), jnp.asarray(others), FREE)
        said.append(bool(progress.stalled(FREE)))
    assert not any(said) and int(progress.waited) == 10


def test_a_strategy_is_low_below_four_tenths() -> None:
    """Its fitness is its whole population's mean, which never comes near the best."""
    anew = []
    for level in (0.375, 0.5):
        progress = Progress.create(jnp.zeros(GENES), FREE)
        for value in (0.0, *[level] * 4):
            progress = progress.observe(jnp.float32(value), jnp.asarray(NOTHING), FREE)
        anew.append((bool(progress.stalled(FREE)), bool(progress.stalled(FREE, LOW_AVERAGE))))
    assert anew == [(True, True), (True, False)]
