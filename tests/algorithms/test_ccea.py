"""One generation of CCEA against loops, and coevolution as the evolver of another algorithm.

All numbers differ: 3 agents, 2 types, 5 episodes, subpopulations of 6 in 2 teams each, 4 elites.
"""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import skillcrew as sc
from algorithms.test_ea import AGENTS, DISCOUNT, EPISODES, WORLD
from oracles.actors import ActorWorlds, discounted, steps_of
from skillcrew.envs.rover.world import RoverDomain
from skillcrew.policies.memory import MemoryNetwork, PolicyConfig
from skillcrew.policies.population import GenomeCodec
from skillcrew.policies.selector import SelectorConfig

SIZE, TEAMS, ELITES = 6, 2, 4


@pytest.fixture(scope="module")
def ccea() -> sc.CCEA:
    return sc.CCEA(
        RoverDomain(WORLD),
        population=SIZE * TEAMS,
        episodes=EPISODES,
        fitness_discount=DISCOUNT,
        evolution=sc.EvolutionConfig(elites=ELITES),
        coevolution=sc.CoevolutionConfig(teams=TEAMS),
        actor=PolicyConfig(hidden=(8,)),
    )


@pytest.fixture(scope="module")
def generation(ccea) -> tuple[Any, Any, dict[str, Any]]:
    before = jax.jit(ccea.init)(jax.random.key(3))
    return before, *jax.jit(ccea.step)(before)


def test_individuals_are_credited_with_the_best_of_their_teams(ccea, generation) -> None:
    before, after, measured = generation
    own = before.search.subpopulations.genomes
    assert own.shape[:2] == (AGENTS, SIZE)
    codec = GenomeCodec(
        lambda key: MemoryNetwork.create(key, ccea.env.observation_size, 2, ccea.config.actor), AGENTS
    )
    members = np.asarray(before.search.members)
    teams = [
        codec.decode(jnp.concatenate([own[agent, index] for agent, index in enumerate(team)]))
        for team in members
    ]
    start_keys = jax.random.split(jax.random.split(before.key, 4)[1], EPISODES)
    lived = ActorWorlds(ccea.env).episodes(teams, start_keys)
    fitness = np.array([np.mean([discounted(one, DISCOUNT) for one in team]) for team in lived])
    assert len(np.unique(fitness)) > 3
    assert measured["environment_steps"] == steps_of(lived)
    for agent in range(AGENTS):
        credit = np.array([fitness[members[:, agent] == one].max() for one in range(SIZE)])
        order = np.argsort(-credit, kind="stable")[:ELITES]
        subpopulation = jax.tree.map(lambda leaf, agent=agent: leaf[agent], after.search.subpopulations)
        np.testing.assert_allclose(subpopulation.lineage.mean[:ELITES], credit[order], rtol=1e-4)
        np.testing.assert_array_equal(subpopulation.genomes[:ELITES], own[agent][order])


def test_the_reported_team_has_each_subpopulations_champion(ccea, generation) -> None:
    _, after, measured = generation
    team = ccea.team(after)
    flat = np.concatenate([np.asarray(leaf).reshape(AGENTS, -1) for leaf in jax.tree.leaves(team.actors)], 1)
    champions = np.asarray(after.search.subpopulations.genomes[:, 0])
    np.testing.assert_array_equal(np.sort(flat, axis=1), np.sort(champions, axis=1))
    expected = np.asarray(after.search.subpopulations.lineage.mean[:, 0]).mean()
    assert float(measured["champion_fitness"]) == pytest.approx(float(expected))


@pytest.mark.parametrize("kind", [sc.MADyS, sc.MFL], ids=lambda kind: kind.name)
def test_selectors_coevolve_too(kind: Any) -> None:
    """A generation takes the state to one of the same structure, with subpopulations of selectors."""
    algorithm = kind(
        sc.make("rover-t2-c2", n_agents=3),
        evolver="coevolution",
        population=SIZE * TEAMS,
        coevolution=sc.CoevolutionConfig(teams=TEAMS, hall_of_fame=sc.HallOfFameConfig(size=5)),
    )
    before = jax.eval_shape(algorithm.init, jax.random.key(0))
    after, metrics = jax.eval_shape(algorithm.step, before)
    assert jax.tree.map(lambda leaf: (leaf.shape, leaf.dtype), after) == jax.tree.map(
        lambda leaf: (leaf.shape, leaf.dtype), before
    )
    genes = before.search.subpopulations.genomes.shape[-1]
    assert before.search.subpopulations.genomes.shape == (3, SIZE, genes)
    assert before.search.hall.genomes.shape == (5, 3, genes)
    assert "champion_fitness" in metrics


@pytest.mark.parametrize(
    ("make", "expected"),
    [
        (
            lambda: sc.CCEA(sc.make("rover-t2-c2"), actor=PolicyConfig(sharing="team")),
            ["evolver = coevolution", "set its sharing to agent"],
        ),
        (
            lambda: sc.CCEA(sc.make("rover-t2-c1"), coevolution=sc.CoevolutionConfig(teams=2)),
            ["coevolution.teams = 2", "with 1 agent(s) there are only 1 team(s)", "at most 1"],
        ),
        (
            lambda: sc.MADyS(
                sc.make("rover-t2-c3"), evolver="coevolution", selector=SelectorConfig(sharing="team")
            ),
            ["evolver = coevolution", "set its sharing to agent"],
        ),
    ],
)
def test_what_cannot_coevolve_is_refused(make, expected) -> None:
    with pytest.raises(sc.UserError) as refused:
        make()
    for part in expected:
        assert part in str(refused.value)
