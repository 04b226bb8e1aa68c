"""One generation of the genetic algorithm, against the rule written again in NumPy."""

import dataclasses
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import stats

from skillcrew.evolution.evolver import Migrants
from skillcrew.evolution.genetic import EvolutionConfig, GeneticAlgorithm, GeneticState, next_generation
from skillcrew.evolution.lineage import Level, Lineage
from skillcrew.evolution.mutation import MutationConfig

CASES, POPULATION, ELITES, GENES = 300, 11, 3, 6
CROSSED = 6
"""crossover_share 0.75 of the 8 children."""
CONFIG = EvolutionConfig(
    elites=ELITES,
    tournament_size=2,
    crossover_share=0.75,
    lineage_memory=5.0,
    lineage_prior=1.5,
    champion_prior=9.0,
    lineage_inheritance=0.3,
    mutation=MutationConfig(probability=0.0),
)


def of(values: np.ndarray, individuals: np.ndarray) -> np.ndarray:
    return np.take_along_axis(values, individuals, axis=1)


def draw(key, population: int):
    return jax.random.normal(key, (population, GENES))


def evolve(config: EvolutionConfig) -> dict[str, Any]:
    """Many generations side by side, each of a population with a past and a fitness of its own."""
    rng = np.random.default_rng(0)
    past = rng.uniform(0, 1, (CASES, POPULATION)).astype(np.float32)
    known = rng.integers(0, 7, (CASES, POPULATION)).astype(np.float32)
    fitness = rng.uniform(0, 1, (CASES, POPULATION)).astype(np.float32)
    # Each individual's genes carry its index, so that every child tells who its parents are.
    genomes = jnp.tile(jnp.arange(1.0, POPULATION + 1)[:, None], (1, GENES))

    def generation(key, past, known, fitness):
        state = dataclasses.replace(GeneticState.create(genomes), lineage=Lineage(past, known))
        return next_generation(key, state, fitness, config)

    keys = jax.random.split(jax.random.key(1), CASES)
    after = jax.jit(jax.vmap(generation))(keys, past, known, fitness)
    # The stated rule: at most `memory - 1` past evaluations count, and this one.
    counted = np.minimum(known, config.lineage_memory - 1)
    mean = (past * counted + fitness) / (counted + 1)

    def standing(prior: float) -> np.ndarray:
        """Ranked as if each had also lived `prior` evaluations at the population's mean."""
        return (mean * (counted + 1) + mean.mean(1, keepdims=True) * prior) / (counted + 1 + prior)

    order = np.argsort(-standing(config.lineage_prior), axis=1, kind="stable")
    # The elites among themselves, the surest first.
    sure = of(standing(config.champion_prior), order[:, : config.elites])
    order[:, : config.elites] = of(order[:, : config.elites], np.argsort(-sure, axis=1, kind="stable"))
    # The others by nothing but their own mean.
    promise = mean.copy()
    np.put_along_axis(promise, order[:, : config.elites], -np.inf, axis=1)
    promising = np.argsort(-promise, axis=1, kind="stable")[:, : config.challengers]
    return {
        "genomes": np.asarray(after.genomes),
        "parents": np.asarray(after.genomes).astype(int) - 1,
        "mean": np.asarray(after.lineage.mean),
        "evaluations": np.asarray(after.lineage.evaluations),
        "champion": np.asarray(jax.vmap(GeneticAlgorithm(config, draw).champion)(after)),
        "expected_mean": mean,
        "expected_evaluations": counted + 1,
        "standing": standing(config.lineage_prior),
        "order": order,
        "promising": promising,
        "fitness": fitness,
    }


@pytest.fixture(scope="module")
def evolved() -> dict[str, Any]:
    return evolve(CONFIG)


@pytest.fixture(scope="module")
def mutated() -> dict[str, Any]:
    mutation = MutationConfig(kind="gaussian", probability=0.5, gaussian_deviation=0.01)
    return evolve(dataclasses.replace(CONFIG, selection="proportional", mutation=mutation))


CHALLENGERS = 2


@pytest.fixture(scope="module")
def challenged() -> dict[str, Any]:
    mutation = MutationConfig(kind="gaussian", probability=1.0, gaussian_deviation=0.01)
    return evolve(dataclasses.replace(CONFIG, challengers=CHALLENGERS, mutation=mutation))


def test_population_keeps_its_size(evolved) -> None:
    assert evolved["genomes"].shape == (CASES, POPULATION, GENES)
    assert evolved["mean"].shape == evolved["evaluations"].shape == (CASES, POPULATION)


@pytest.mark.parametrize("name", ["evolved", "mutated"])
def test_elites_survive_unchanged_at_the_front_in_rank_order(name: str, request) -> None:
    result = request.getfixturevalue(name)
    elites = result["order"][:, :ELITES]
    expected = np.broadcast_to(elites[..., None] + 1, (CASES, ELITES, GENES))
    np.testing.assert_array_equal(result["genomes"][:, :ELITES], expected)
    np.testing.assert_allclose(result["mean"][:, :ELITES], of(result["expected_mean"], elites), rtol=1e-5)
    np.testing.assert_allclose(
        result["evaluations"][:, :ELITES], of(result["expected_evaluations"], elites), rtol=1e-6
    )


def test_challengers_survive_unchanged_after_the_elites_by_their_own_mean(challenged) -> None:
    after = challenged["genomes"]
    assert after.shape == (CASES, POPULATION, GENES)
    survivors = np.concatenate([challenged["order"][:, :ELITES], challenged["promising"]], axis=1)
    expected = np.broadcast_to(survivors[..., None] + 1, (*survivors.shape, GENES))
    np.testing.assert_array_equal(after[:, : ELITES + CHALLENGERS], expected)
    # They keep all they have earned.
    kept = {"mean": challenged["expected_mean"], "evaluations": challenged["expected_evaluations"]}
    for name, values in kept.items():
        np.testing.assert_allclose(
            challenged[name][:, : ELITES + CHALLENGERS], of(values, survivors), rtol=1e-5
        )
    # They do not lead, whatever their mean promises, and are not the next in rank.
    np.testing.assert_array_equal(challenged["champion"][:, 0] - 1, challenged["order"][:, 0])
    best = of(challenged["expected_mean"], challenged["promising"])[:, 0]
    assert (best > of(challenged["expected_mean"], challenged["order"][:, :1])[:, 0]).mean() > 0.05
    next_in_rank = challenged["order"][:, ELITES : ELITES + CHALLENGERS]
    assert (np.sort(next_in_rank) != np.sort(challenged["promising"])).any(1).mean() > 0.05


def test_all_others_are_children_though_there_are_challengers(challenged) -> None:
    children = challenged["genomes"][:, ELITES + CHALLENGERS :]
    assert (children != children.round()).all(-1).all()
    parents = children.round().astype(int) - 1
    # Mates are elites and nobody else; 0.75 of the 6 children are crossed, rounded to even.
    crossed = parents[:, :4]
    elites = challenged["order"][:, :ELITES]
    assert (crossed[..., 0][..., None] == elites[:, None]).any(-1).all()
    copies = parents[:, 4:]
    assert (copies == copies[..., :1]).all()
    expected = of(challenged["expected_mean"], parents[..., -1])
    np.testing.assert_allclose(challenged["mean"][:, ELITES + CHALLENGERS :], expected, rtol=1e-5)


def test_by_default_nobody_challenges() -> None:
    assert EvolutionConfig().challengers == 0


def test_champion_is_the_surest_elite_not_the_luckiest_evaluation(evolved) -> None:
    best = evolved["order"][:, 0]
    np.testing.assert_array_equal(evolved["champion"][:, 0] - 1, best)
    # The rule matters: the best of the last evaluation, of the plain means, and of those that few
    # evaluations speak for, is often somebody else.
    assert (evolved["standing"].argmax(1) != best).mean() > 0.05
    assert (evolved["fitness"].argmax(1) != best).mean() > 0.3
    assert (evolved["expected_mean"].argmax(1) != best).mean() > 0.05


def test_one_perfect_evaluation_does_not_outrank_ten_good_ones() -> None:
    lineage = Lineage(jnp.array([1.0, 0.9, 0.5, 0.4, 0.2]), jnp.array([1.0, 10.0, 1.0, 1.0, 1.0]))
    assert int(jnp.argmax(lineage.standing(3.0, lineage.mean.mean()))) == 1
    assert int(jnp.argmax(lineage.standing(0.0, lineage.mean.mean()))) == 0


def test_crossed_children_begin_as_an_elite_and_end_as_their_other_parent(evolved) -> None:
    crossed = evolved["parents"][:, ELITES : ELITES + CROSSED]
    elites = evolved["order"][:, :ELITES]
    mate = crossed[..., 0]
    assert (mate[..., None] == elites[:, None]).any(-1).all()
    # One change from mate to partner at most: the two may be the same individual.
    assert ((np.diff(crossed, axis=-1) != 0).sum(-1) <= 1).all()
    differ = mate != crossed[..., -1]
    assert differ.mean() > 0.5
    assert not (crossed[..., -1][..., None] == elites[:, None]).any(-1).all()


def test_every_elite_is_a_mate_equally_often(evolved) -> None:
    mate = evolved["parents"][:, ELITES : ELITES + CROSSED, 0]
    standing = (mate[..., None] == evolved["order"][:, None, :ELITES]).argmax(-1)
    assert stats.chisquare(np.bincount(standing.ravel(), minlength=ELITES)).pvalue > 1e-3


def test_the_other_children_are_whole_members_of_the_selected_set(evolved) -> None:
    copies = evolved["parents"][:, ELITES + CROSSED :]
    assert (copies == copies[..., :1]).all()
    # Tournaments of two: the winner stands at place i with probability ((n - i)² - (n - i - 1)²) / n².
    place = evolved["order"].argsort(1)
    places = np.bincount(of(place, copies[..., 0]).ravel(), minlength=POPULATION)
    worse_than = ((POPULATION - np.arange(POPULATION + 1)) / POPULATION) ** 2
    expected = places.sum() * (worse_than[:-1] - worse_than[1:])
    assert stats.chisquare(places, expected).pvalue > 1e-3


def test_crossed_children_inherit_a_share_and_unchanged_copies_keep_everything(evolved) -> None:
    partner = evolved["parents"][:, ELITES:, -1]
    share = np.where(np.arange(POPULATION - ELITES) < CROSSED, 0.3, 1.0)
    np.testing.assert_allclose(evolved["mean"][:, ELITES:], of(evolved["expected_mean"], partner), rtol=1e-5)
    expected = of(evolved["expected_evaluations"], partner) * share
    np.testing.assert_allclose(evolved["evaluations"][:, ELITES:], expected, rtol=1e-5)


def test_mutated_copies_inherit_a_share_too(mutated) -> None:
    genomes = mutated["genomes"][:, ELITES + CROSSED :]
    changed = (genomes != genomes.round()).any(-1)
    assert 0.4 < changed.mean() < 0.6
    parent = genomes[..., -1].round().astype(int) - 1
    expected = of(mutated["expected_evaluations"], parent) * np.where(changed, 0.3, 1.0)
    np.testing.assert_allclose(mutated["evaluations"][:, ELITES + CROSSED :], expected, rtol=1e-5)


def test_crossed_children_mutate_too(mutated) -> None:
    genomes = mutated["genomes"][:, ELITES : ELITES + CROSSED]
    assert 0.4 < (genomes != genomes.round()).any(-1).mean() < 0.6


def test_proportional_selection_favours_by_share_of_fitness(mutated) -> None:
    parent = mutated["genomes"][:, ELITES + CROSSED :, -1].round().astype(int) - 1
    drawn = np.zeros((CASES, POPULATION))
    np.add.at(drawn, (np.arange(CASES)[:, None], parent), 1)
    mean = mutated["standing"]
    expected = parent.shape[1] * mean / mean.sum(1, keepdims=True)
    # Over all cases, the mean of what was drawn is what the shares make of it (standard error 0.008).
    assert (drawn * mean).sum() / drawn.sum() == pytest.approx(
        (expected * mean).sum() / drawn.sum(), abs=0.03
    )


@pytest.mark.parametrize("crossover_share", [0.0, 1.0])
def test_all_or_none_of_the_children_may_be_crossed(crossover_share: float) -> None:
    config = dataclasses.replace(CONFIG, crossover_share=crossover_share)
    genomes = jnp.tile(jnp.arange(5.0)[:, None], (1, 40))
    after = jax.jit(lambda key: next_generation(key, GeneticState.create(genomes), jnp.arange(5.0), config))(
        jax.random.key(0)
    )
    assert after.genomes.shape == genomes.shape
    mixed = np.asarray(after.genomes != after.genomes[:, :1]).any(1)[ELITES:]
    assert crossover_share == 1 or not mixed.any()


# The same through the interface that algorithms use


GENETIC = GeneticAlgorithm(dataclasses.replace(CONFIG, lineage_memory=20.0), draw)
KNOWN = np.array([0.5, 0.9, 0.1, 0.6, 0.3, 0.2, 0.7], np.float32)
EVALUATIONS = np.array([4.0, 1.0, 9.0, 2.0, 5.0, 3.0, 0.0], np.float32)
FITNESS = np.array([0.1, 0.0, 0.5, 0.7, 0.2, 0.1, 1.0], np.float32)
WEIGHTS = np.array([1.0, 5.0, 1.0, 5.0, 1.0, 1.0, 5.0], np.float32)


def known_population() -> GeneticState:
    genomes = jnp.tile(jnp.arange(1.0, 8.0)[:, None], (1, GENES))
    return dataclasses.replace(
        GeneticState.create(genomes), lineage=Lineage(jnp.asarray(KNOWN), jnp.asarray(EVALUATIONS))
    )


def test_a_population_begins_as_it_is_drawn_and_unknown() -> None:
    state = GENETIC.init(jax.random.key(4), 7)
    np.testing.assert_array_equal(GENETIC.genomes(state), draw(jax.random.key(4), 7))
    assert state.lineage.evaluations.tolist() == [0.0] * 7


def test_heavier_evaluations_count_for_more_and_the_champion_is_first() -> None:
    next_generation = jax.jit(GENETIC.next_generation)
    after = next_generation(jax.random.key(5), known_population(), jnp.asarray(FITNESS), jnp.asarray(WEIGHTS))
    counted = EVALUATIONS + WEIGHTS
    mean = (KNOWN * EVALUATIONS + FITNESS * WEIGHTS) / counted

    def standing(prior: float) -> np.ndarray:
        return (mean * counted + mean.mean() * prior) / (counted + prior)

    elites = np.argsort(-standing(CONFIG.lineage_prior))[:ELITES]
    elites = elites[np.argsort(-standing(CONFIG.champion_prior)[elites])]
    assert (GENETIC.genomes(after)[:ELITES, 0] - 1).tolist() == elites.tolist()
    np.testing.assert_allclose(after.lineage.mean[:ELITES], mean[elites], rtol=1e-5)
    np.testing.assert_allclose(after.lineage.evaluations[:ELITES], counted[elites])
    np.testing.assert_array_equal(GENETIC.champion(after), np.full(GENES, elites[0] + 1.0))
    assert float(GENETIC.champion_fitness(after)) == pytest.approx(mean[elites[0]])
    # The weights matter: with equal ones the elites would be others.
    alike = next_generation(jax.random.key(5), known_population(), jnp.asarray(FITNESS), jnp.ones(7))
    assert (GENETIC.genomes(alike)[:ELITES, 0] - 1).tolist() != elites.tolist()


def test_standing_takes_in_the_present_evaluation() -> None:
    mean = (KNOWN * EVALUATIONS + FITNESS) / (EVALUATIONS + 1)
    prior = CONFIG.lineage_prior
    expected = (mean * (EVALUATIONS + 1) + mean.mean() * prior) / (EVALUATIONS + 1 + prior)
    np.testing.assert_allclose(
        GENETIC.standing(known_population(), jnp.asarray(FITNESS)), expected, rtol=1e-5
    )


@pytest.mark.parametrize("veterans", [0, 1])
def test_newcomers_who_have_been_lucky_crowd_out_no_veteran(veterans: int) -> None:
    # One has proven itself in thirty evaluations; seven have lived two, in which all did well.
    mean = jnp.array([1.0, 1.0, 0.85, 1.0, 1.0, 0.9, 0.9, 0.9])
    lineage = Lineage(mean, jnp.array([1.0, 1.0, 29.0, 1.0, 1.0, 1.0, 1.0, 1.0]))
    config = dataclasses.replace(
        CONFIG,
        lineage_memory=40.0,
        lineage_prior=0.0,
        champion_prior=9.0,
        veterans=veterans,
        level_memory=20.0,
    )
    genomes = jnp.tile(jnp.arange(8.0)[:, None], (1, GENES))
    # Eleven generations before this one were at 0.3.
    level = Level(jnp.array(0.3), jnp.array(11.0))
    state = dataclasses.replace(GeneticState.create(genomes), lineage=lineage, level=level)
    after = jax.jit(lambda state: next_generation(jax.random.key(0), state, jnp.ones(8), config))(state)
    elites = after.genomes[:ELITES, 0].astype(int).tolist()
    assert set(elites) - {2} <= {0, 1, 3, 4}
    assert elites.count(2) == veterans
    assert (elites[0] == 2) == bool(veterans), "the surest is the champion"
    told = float(lineage.add(jnp.ones(8), 40.0).mean.mean())
    assert float(after.level.mean) == pytest.approx((0.3 * 11 + told) / 12, rel=1e-5)
    assert float(after.level.generations) == 12.0


@pytest.mark.parametrize("memory", [1.0, 3.0])
def test_a_level_remembers_so_many_generations(memory: float) -> None:
    level, told = Level.create(), [0.2, 0.8, 0.5, 0.1, 0.9]
    expected = 0.0
    for generation, mean in enumerate(told):
        level = level.add(Lineage(jnp.array([mean, mean]), jnp.ones(2)), memory)
        weight = 1 / min(generation + 1, memory)
        expected = (1 - weight) * expected + weight * mean
        assert float(level.mean) == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("arrive", [True, False])
def test_migrants_take_the_places_of_the_worst(arrive: bool) -> None:
    """Of what is known of everybody, not of one unlucky evaluation; and nothing is known of them yet."""
    evolver = GeneticAlgorithm(CONFIG, draw)
    rng = np.random.default_rng(6)
    mean = jnp.asarray(rng.uniform(0, 1, POPULATION).astype(np.float32))
    genomes = draw(jax.random.key(0), POPULATION)
    lineage = Lineage(mean, jnp.full(POPULATION, 4.0))
    state = dataclasses.replace(GeneticState.create(genomes), lineage=lineage)
    fitness = jnp.asarray(rng.uniform(0, 1, POPULATION).astype(np.float32))
    newcomers = Migrants(jnp.full((2, GENES), 9.0), jnp.array([0.25, 0.5]), jnp.asarray(arrive))
    admit = jax.jit(lambda state, fitness, newcomers: evolver._admit(state, fitness, 1.0, newcomers))
    after, told, weights = admit(state, fitness, newcomers)
    known = 4 * np.asarray(mean) + np.asarray(fitness)
    worst = set(np.argsort(known)[:2].tolist()) if arrive else set()
    assert set(np.flatnonzero((np.asarray(after.genomes) == 9.0).all(1)).tolist()) == worst
    assert int(np.argmin(fitness)) not in worst, "the unluckiest is not the worst"
    for one in range(POPULATION):
        if one in worst:
            assert float(after.lineage.evaluations[one]) == 0.0
            assert float(told[one]) in (0.25, 0.5)
            assert float(weights[one]) == 1.0
        else:
            np.testing.assert_array_equal(after.genomes[one], state.genomes[one])
            assert (float(told[one]), float(after.lineage.mean[one])) == (
                float(fitness[one]),
                float(mean[one]),
            )
            assert float(after.lineage.evaluations[one]) == 4.0


def test_variation_is_told_whether_anybody_was_better() -> None:
    told = []

    class Telling:
        def crossover(self, key, first, second):
            return first

        def mutate(self, key, genomes, judged):
            told.append(bool(judged))
            return genomes, jnp.zeros(len(genomes), bool)

    state = GeneticState.create(draw(jax.random.key(0), POPULATION))
    for fitness in (jnp.full(POPULATION, -3.0), jnp.full(POPULATION, -3.0).at[4].set(-2.5)):
        next_generation(jax.random.key(1), state, fitness, CONFIG, variation=Telling())
    assert told == [False, True]
