"""Cooperative coevolution: who plays with whom, what each is credited with, and what survives.

All numbers differ: 3 agents, subpopulations of 7, 4 teams for each individual, 5 genes, 2 in the hall.
"""

import dataclasses
import functools
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from oracles.refusals import refusal, unhooked
from skillcrew.evolution import coevolution
from skillcrew.evolution.coevolution import CoevolutionConfig, CoevolutionState, CooperativeCoevolution
from skillcrew.evolution.evolver import Migrants
from skillcrew.evolution.genetic import EvolutionConfig
from skillcrew.evolution.hall_of_fame import HallOfFameConfig

AGENTS, SIZE, TEAMS, GENES, KEPT = 3, 7, 4, 5, 2
POPULATION = SIZE * TEAMS
EVOLUTION = EvolutionConfig(elites=2, tournament_size=2)
CONFIG = CoevolutionConfig(teams=TEAMS, hall_of_fame=HallOfFameConfig(size=KEPT, share=0.6))

loaded = unhooked(coevolution)


def draw(key, population: int):
    return jax.random.normal(key, (population, AGENTS * GENES))


def evolver_of(**changes: Any) -> CooperativeCoevolution:
    return CooperativeCoevolution(EVOLUTION, dataclasses.replace(CONFIG, **changes), draw, AGENTS)


@functools.cache
def compiled(credit: str) -> tuple[CooperativeCoevolution, Any, Any]:
    """An evolver, and its `init` and `next_generation` as programs."""
    evolver = evolver_of(credit=credit)
    init = jax.jit(lambda key: evolver.init(key, POPULATION))
    return evolver, init, jax.jit(evolver.next_generation)


@pytest.fixture(scope="module")
def fitness() -> list[jax.Array]:
    rng = np.random.default_rng(2)
    return [jnp.asarray(rng.uniform(0, 1, POPULATION).astype(np.float32)) for _ in range(3)]


@pytest.fixture(scope="module", params=["max", "mean", "min"])
def lived(request, fitness) -> tuple[CooperativeCoevolution, list[CoevolutionState]]:
    """Four generations: the first has an empty hall, the last a full one."""
    evolver, init, step = compiled(request.param)
    states = [init(jax.random.key(0))]
    for number, values in enumerate(fitness):
        states.append(step(jax.random.key(10 + number), states[-1], values))
    return evolver, states


def test_without_a_hall_everybody_plays_equally_often_and_teams_are_whole() -> None:
    evolver = evolver_of(hall_of_fame=HallOfFameConfig())
    state = evolver.init(jax.random.key(3), POPULATION)
    assert state.members.shape == (POPULATION, AGENTS)
    # Checkpoints take no empty arrays.
    assert all(leaf.size for leaf in jax.tree.leaves(state))
    for round_of_teams in np.asarray(state.members).reshape(TEAMS, SIZE, AGENTS):
        for agent in range(AGENTS):
            assert sorted(round_of_teams[:, agent]) == list(range(SIZE))
    # Partners change from team to team, and agents are permuted apart.
    assert len({tuple(team) for team in np.asarray(state.members)}) > POPULATION / 2


def test_genomes_are_the_members_own_agent_by_agent(lived) -> None:
    evolver, states = lived
    state = states[-1]
    genomes = np.asarray(evolver.genomes(state)).reshape(POPULATION, AGENTS, GENES)
    famous = 0
    for team in range(POPULATION):
        for agent in range(AGENTS):
            index = int(state.members[team, agent])
            if index < SIZE:
                expected = state.subpopulations.genomes[agent, index]
            else:
                famous += 1
                expected = state.hall.genomes[index - SIZE, agent]
            np.testing.assert_array_equal(genomes[team, agent], expected)
    assert famous > 5


def test_credit_is_of_several_teams_and_of_the_living_alone(lived, fitness) -> None:
    """Each subpopulation's best elite carries the credit that loops find for it."""
    evolver, states = lived
    combine = {"max": max, "mean": np.mean, "min": min}[evolver.config.credit]
    first, second = states[:2]
    for agent in range(AGENTS):
        credits = []
        for individual in range(SIZE):
            played = [
                float(fitness[0][team])
                for team in range(POPULATION)
                if int(first.members[team, agent]) == individual
            ]
            assert len(played) == TEAMS
            credits.append(combine(played))
        order = np.argsort(-np.asarray(credits), kind="stable")[: EVOLUTION.elites]
        np.testing.assert_allclose(
            second.subpopulations.lineage.mean[agent, : EVOLUTION.elites],
            np.asarray(credits)[order],
            rtol=1e-5,
        )
        np.testing.assert_array_equal(
            second.subpopulations.genomes[agent, : EVOLUTION.elites],
            np.asarray(first.subpopulations.genomes[agent])[order],
        )


def test_leniency_forgives_one_bad_team() -> None:
    """One individual plays in the best team and in the worst; only the mean and the minimum blame it."""
    state = compiled("max")[1](jax.random.key(4))
    its_teams = np.flatnonzero(np.asarray(state.members[:, 1]) == 5)
    values = np.full(POPULATION, 0.5, np.float32)
    values[its_teams] = [0.0, 0.0, 0.0, 1.0]
    best = {}
    for credit in ("max", "mean", "min"):
        after = compiled(credit)[2](jax.random.key(5), state, jnp.asarray(values))
        elite = after.subpopulations.genomes[1, 0]
        best[credit] = bool((elite == state.subpopulations.genomes[1, 5]).all())
    assert best == {"max": True, "mean": False, "min": False}


def test_the_best_team_of_each_generation_enters_the_hall_and_outlives_a_catastrophe(lived, fitness) -> None:
    evolver, states = lived
    tops = [
        (float(values.max()), np.asarray(evolver.genomes(state)[int(values.argmax())]))
        for state, values in zip(states, fitness, strict=False)
    ]
    expected = sorted(tops, key=lambda top: -top[0])[:KEPT]
    hall = states[-1].hall
    order = np.argsort(-np.asarray(hall.fitness))
    for place, (value, genome) in zip(order, expected, strict=True):
        assert float(hall.fitness[place]) == pytest.approx(value)
        np.testing.assert_array_equal(hall.genomes[place].reshape(-1), genome)
    step = compiled(evolver.config.credit)[2]
    after = step(jax.random.key(6), states[-1], jnp.zeros(POPULATION))
    jax.tree.map(np.testing.assert_array_equal, after.hall, hall)


def test_the_famous_play_at_their_share_but_never_alone_nor_in_the_first_teams(lived) -> None:
    evolver, states = lived
    assert (np.asarray(states[0].members) < SIZE).all(), "nobody is famous yet"
    keys = jax.random.split(jax.random.key(100), 60)
    drawn = jax.jit(jax.vmap(lambda key: evolver._team_up(key, SIZE, states[-1].hall)))(keys)
    famous = []
    for members in np.asarray(drawn):
        assert (members[:SIZE] < SIZE).all()
        assert (members < SIZE).any(axis=1).all()
        assert members.max() < SIZE + KEPT
        famous.append((members[SIZE:] >= SIZE).mean())
    # Two of three places may be taken, each with probability 0.6.
    assert np.mean(famous) == pytest.approx(0.6 * 2 / 3, abs=0.03)


def test_with_the_hall_everybody_still_plays(lived, fitness) -> None:
    """And is credited with a finite number, also who plays only once."""
    for state in lived[1]:
        for agent in range(AGENTS):
            assert set(range(SIZE)) <= set(np.asarray(state.members[:, agent]).tolist())
        assert np.isfinite(state.subpopulations.lineage.mean).all()


def test_the_champion_is_every_subpopulations_first(lived) -> None:
    evolver, states = lived
    state = states[-1]
    champion = np.asarray(evolver.champion(state)).reshape(AGENTS, GENES)
    np.testing.assert_array_equal(champion, state.subpopulations.genomes[:, 0])
    assert float(evolver.champion_fitness(state)) == pytest.approx(
        float(state.subpopulations.lineage.mean[:, 0].mean())
    )
    np.testing.assert_array_equal(evolver.standing(state, jnp.arange(3.0)), jnp.arange(3.0))


def test_genes_never_cross_from_one_agent_to_another() -> None:
    """Each agent's genes stay near its own number, whoever breeds with whom."""
    offset = (100.0 * jnp.arange(1.0, AGENTS + 1)).repeat(GENES)
    evolution = dataclasses.replace(
        EVOLUTION, mutation=dataclasses.replace(EVOLUTION.mutation, probability=0.0)
    )
    evolver = CooperativeCoevolution(evolution, CONFIG, lambda key, n: draw(key, n) + offset[None], AGENTS)
    state = evolver.init(jax.random.key(7), POPULATION)
    step = jax.jit(evolver.next_generation)
    before = np.asarray(state.subpopulations.genomes)
    for number in range(4):
        key = jax.random.key(number)
        state = step(key, state, jax.random.uniform(key, (POPULATION,)))
        genomes = np.asarray(evolver.genomes(state))
        np.testing.assert_allclose(genomes, np.tile(offset, (POPULATION, 1)), atol=10)
    assert not np.array_equal(before, state.subpopulations.genomes)


@pytest.mark.parametrize("arrive", [True, False])
def test_a_migrating_teams_members_replace_the_worst_of_their_subpopulations(arrive: bool) -> None:
    """With the fitness of their team: as the best of all they are everybody's champion, as a new elite."""
    evolver, init, _ = compiled("mean")
    state = init(jax.random.key(4))
    fitness = jnp.asarray(np.random.default_rng(5).uniform(0, 1, POPULATION).astype(np.float32))
    team = 50.0 + jnp.arange(AGENTS * GENES, dtype=jnp.float32)
    migrants = Migrants(team[None], jnp.array([2.0]), jnp.asarray(arrive))
    step = jax.jit(evolver.next_generation)
    after = step(jax.random.key(6), state, fitness, migrants=migrants)
    of_members = jnp.broadcast_to(fitness[:, None], state.members.shape)
    credit = np.asarray(evolver._credit(state, of_members))
    for agent in range(AGENTS):
        own = team.reshape(AGENTS, GENES)[agent]
        elites = np.asarray(after.subpopulations.genomes[agent, : EVOLUTION.elites])
        best = np.asarray(state.subpopulations.genomes[agent, credit[agent].argmax()])
        if arrive:
            np.testing.assert_array_equal(elites[0], own)
            assert (elites[1] == best).all(), "it took the place of the worst, not of the best"
        else:
            np.testing.assert_array_equal(elites[0], best)
    plain = step(jax.random.key(6), state, fitness)
    if not arrive:
        np.testing.assert_array_equal(after.subpopulations.genomes, plain.subpopulations.genomes)


def test_it_finds_what_only_partners_can_reach_together() -> None:
    """A team's fitness is 1 minus the distance of its members' sum from a target: nobody reaches it alone."""
    target = jnp.linspace(-1.0, 1.5, GENES)

    def team_fitness(genomes):
        together = genomes.reshape(-1, AGENTS, GENES).sum(1)
        return 1.0 / (1.0 + jnp.abs(together - target[None]).mean(1))

    evolver = evolver_of()

    def generation(state, key):
        return evolver.next_generation(key, state, team_fitness(evolver.genomes(state))), None

    state = evolver.init(jax.random.key(8), POPULATION)
    before = float(team_fitness(evolver.champion(state)[None])[0])
    keys = jax.random.split(jax.random.key(9), 150)
    state, _ = jax.jit(lambda s: jax.lax.scan(generation, s, keys))(state)
    assert before < 0.6 < 0.85 < float(team_fitness(evolver.champion(state)[None])[0])


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        ({"teams": 0}, ["coevolution.teams = 0: give at least 1"]),
        ({"credit": "maximum"}, ["coevolution.credit 'maximum'", "max"]),
        (
            {"hall_of_fame": HallOfFameConfig(size=3)},
            ["coevolution.hall_of_fame.size = 3", "set coevolution.teams to at least 2"],
        ),
    ],
)
def test_refuses_a_value_and_names_field_and_value(fields: dict[str, Any], expected: list[str]) -> None:
    message = refusal(loaded.CoevolutionConfig, **fields)
    for part in expected:
        assert part in message


def test_a_population_must_make_whole_subpopulations_that_can_breed() -> None:
    config = loaded.CoevolutionConfig(teams=3)
    assert "population = 20: no multiple of coevolution.teams = 3" in refusal(
        config.check_population, population=20, evolution=EVOLUTION
    )
    message = refusal(config.check_population, population=9, evolution=EVOLUTION)
    assert "a subpopulation has 3 individuals, fewer than evolution.elites + 2 = 4" in message
    config.check_population(12, EVOLUTION)


@pytest.mark.parametrize(("agents", "possible"), [(1, 1), (2, 6), (3, 36)])
def test_no_more_teams_than_there_are_partners(agents: int, possible: int) -> None:
    loaded.CoevolutionConfig(teams=min(2, possible)).check_agents(12, agents)
    too_many = {1: (2, 12), 2: (7, 42), 3: (37, 37 * 6)}[agents]
    message = refusal(
        loaded.CoevolutionConfig(teams=too_many[0]).check_agents, population=too_many[1], n_agents=agents
    )
    assert f"coevolution.teams = {too_many[0]}: with {agents} agent(s) there are only {possible}" in message
