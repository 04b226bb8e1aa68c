"""A genetic search that stalls low begins anew, and keeps the best that it gave up."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from oracles.rover_cases import quick_jit
from skillcrew.errors import UserError
from skillcrew.evolution.coevolution import CoevolutionConfig
from skillcrew.evolution.genetic import EvolutionConfig, GeneticAlgorithm, GeneticState
from skillcrew.evolution.mutation import MutationConfig
from skillcrew.evolution.restart import RestartConfig

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
PLAIN = GeneticAlgorithm(dataclasses.replace(CONFIG, restart=RestartConfig()), draw)
told = quick_jit(GENETIC.next_generation)
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
    after = wary.next_generation(key_of(0), FIRST, fitness)
    mean = float(fitness.mean())
    assert float(after.progress.fitness) == pytest.approx((1.0 + 20 * mean) / 21, rel=1e-5)


def test_without_patience_nothing_begins_anew_and_no_number_changes() -> None:
    state, before = FIRST, None
    for generation in range(8):
        before, state = state, PLAIN.next_generation(key_of(generation), state, jnp.full(POPULATION, 0.1))
        assert state.lineage.evaluations.any()
    assert int(state.progress.waited) == 7
    patient = GeneticAlgorithm(dataclasses.replace(CONFIG, restart=RestartConfig(patience=100)), draw)
    key = jax.random.key(3)
    fitness = jnp.linspace(0, 1, POPULATION)
    same = PLAIN.next_generation(jax.random.split(key)[0], before, fitness)
    np.testing.assert_array_equal(patient.next_generation(key, before, fitness).genomes, same.genomes)


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
