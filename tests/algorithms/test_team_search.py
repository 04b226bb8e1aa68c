"""Races, and who meets which worlds, against loops that live the same episodes again.

All numbers differ: 3 agents, 2 types, 5 episodes, 7 teams, 4 finalists with 6 more episodes.
"""

import dataclasses
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from oracles.actors import ActorWorlds, discounted, steps_of
from skillcrew.algorithms import skill_learning
from skillcrew.algorithms.ea import EA
from skillcrew.algorithms.madys import MADyS
from skillcrew.algorithms.mfl import MFL, MFLConfig
from skillcrew.algorithms.team_search import RaceConfig, SearchConfig, TeamSearch
from skillcrew.envs.rover.config import RoverConfig
from skillcrew.envs.rover.world import RoverDomain
from skillcrew.evolution.genetic import EvolutionConfig, GeneticAlgorithm
from skillcrew.evolution.lineage import Lineage
from skillcrew.learners.td3 import TD3Config
from skillcrew.policies.memory import MemoryNetwork, PolicyConfig
from skillcrew.policies.network import NetworkConfig
from skillcrew.policies.population import GenomeCodec
from skillcrew.policies.team import ActorTeam
from skillcrew.rollout import rollout

AGENTS, EPISODES, TEAMS, FINALISTS, MORE = 3, 5, 7, 4, 6
DISCOUNT = 0.8
RULES: dict[str, Any] = {
    "n_agents": AGENTS,
    "n_poi_types": 2,
    "spatial_coupling": 2,
    "world_size": 5.0,
    "episode_length": 6,
    "sensor_resolution": 180,
    "activation_distance": 2.2,
    "team_reward": "fraction",
}
ENV = RoverDomain(RoverConfig(**RULES))
CONFIG = SearchConfig(
    population=TEAMS,
    episodes=EPISODES,
    fitness_discount=DISCOUNT,
    evolution=EvolutionConfig(elites=2, lineage_prior=1.0),
)
RACE = dataclasses.replace(CONFIG, race=RaceConfig(FINALISTS, MORE))
CODEC = GenomeCodec(
    lambda key: MemoryNetwork.create(key, ENV.observation_size, 2, PolicyConfig((8,), "sqrt")), AGENTS
)


class Recording(GeneticAlgorithm):
    """Tells what it is told, and breeds nothing."""

    def next_generation(self, key, state, fitness, evaluations=1.0):
        return {"fitness": fitness, "evaluations": evaluations}

    def champion_fitness(self, state):
        return jnp.zeros(())


def recording(config: SearchConfig) -> TeamSearch:
    search = TeamSearch(ENV, CODEC, config)
    search._evolver = Recording(config.evolution, CODEC.create)
    return search


def make_team(actors) -> ActorTeam:
    return ActorTeam(actors, AGENTS)


@dataclasses.dataclass
class Raced:
    """A generation with a race, without one, and the same episodes in loops."""

    told: dict[str, Any]
    metrics: dict[str, Any]
    told_without: dict[str, Any]
    metrics_without: dict[str, Any]
    standing: np.ndarray
    lived: list
    lived_again: list

    def mean_return(self, team: int, lived: list) -> float:
        return float(np.mean([discounted(episode, DISCOUNT) for episode in lived[team]]))

    @property
    def finalists(self) -> np.ndarray:
        return np.argsort(-self.standing, kind="stable")[:FINALISTS]


@pytest.fixture(scope="module")
def raced() -> Raced:
    rng = np.random.default_rng(4)
    past = rng.uniform(0, 1, TEAMS).astype(np.float32)
    known = rng.integers(0, 4, TEAMS).astype(np.float32)

    def generation(config: SearchConfig, key) -> tuple[Any, Any, Any]:
        search, first = recording(config), TeamSearch(ENV, CODEC, config).init(key)
        lineage = Lineage(jnp.asarray(past), jnp.asarray(known))
        state = dataclasses.replace(first, lineage=lineage)
        lineup = search.lineup(state, search.start(jax.random.key(1)), make_team)
        episodes, _ = rollout(ENV, lineup, jax.random.key(2), recorded=slice(0))
        after, metrics = search.evolve(jax.random.key(3), state, episodes, make_team)
        return after, metrics, state.genomes

    told, metrics, genomes = jax.device_get(jax.jit(lambda key: generation(RACE, key))(jax.random.key(0)))
    without = jax.device_get(jax.jit(lambda key: generation(CONFIG, key))(jax.random.key(0)))
    worlds = ActorWorlds(ENV)
    teams = [CODEC.decode(jnp.asarray(genome)) for genome in genomes]
    race_key = jax.random.split(jax.random.split(jax.random.key(3))[1])[0]
    lived = worlds.episodes(teams, jax.random.split(jax.random.key(1), EPISODES))
    lived_again = worlds.episodes(teams, jax.random.split(race_key, MORE))
    fitness = np.array([np.mean([discounted(one, DISCOUNT) for one in team]) for team in lived])
    mean = (past * known + fitness) / (known + 1)
    standing = (mean * (known + 1) + mean.mean()) / (known + 2)
    return Raced(told, metrics, without[0], without[1], standing, lived, lived_again)


def test_without_a_race_fitness_is_the_mean_of_all_teams_episodes(raced) -> None:
    expected = [raced.mean_return(team, raced.lived) for team in range(TEAMS)]
    np.testing.assert_allclose(raced.told_without["fitness"], expected, rtol=1e-4)
    assert raced.told_without["evaluations"].tolist() == [1.0] * TEAMS
    assert "race_steps" not in raced.metrics_without
    assert len(np.unique(expected)) > 3


def test_the_best_by_standing_live_more_episodes_which_all_count(raced) -> None:
    for team in range(TEAMS):
        both = raced.lived[team] + raced.lived_again[team] * (team in raced.finalists)
        assert raced.told["fitness"][team] == pytest.approx(
            np.mean([discounted(episode, DISCOUNT) for episode in both]), rel=1e-4
        )
    # The race decides something, and standing is not the fitness of the day.
    assert np.abs(raced.told["fitness"] - raced.told_without["fitness"])[raced.finalists].max() > 0.01
    assert set(np.argsort(-raced.told_without["fitness"])[:FINALISTS]) != set(raced.finalists)


def test_a_finalists_evaluation_weighs_as_many_episodes_as_it_has(raced) -> None:
    expected = [(EPISODES + MORE) / EPISODES if team in raced.finalists else 1.0 for team in range(TEAMS)]
    np.testing.assert_allclose(raced.told["evaluations"], expected, rtol=1e-6)


def test_the_races_steps_are_told(raced) -> None:
    assert raced.metrics["race_steps"] == steps_of([raced.lived_again[team] for team in raced.finalists])


@pytest.mark.parametrize("kind", [EA, MADyS, MFL])
def test_the_races_steps_are_environment_steps(kind, monkeypatch) -> None:
    # Learning is another test's, and takes long to compile.
    monkeypatch.setattr(skill_learning, "train_skills", lambda key, learner, learners, *rest: (learners, {}))
    received = []
    measure = TeamSearch._race
    # While MFL trains its skills a race decides nothing and is not counted; see its own tests.
    monkeypatch.setattr(MFLConfig, "__post_init__", lambda self: None)

    def race(self, *args):
        received.append(measure(self, *args))
        return received[-1]

    monkeypatch.setattr(TeamSearch, "_race", race)
    fields: dict[str, Any] = {field.name: getattr(RACE, field.name) for field in dataclasses.fields(RACE)}
    if kind is MFL:
        fields["pretraining_steps"] = 0
    if kind is not EA:
        fields |= {"probe_episodes": 1, "skills": ("go_to_poi_A", "go_to_agent"), "updates": 2}
        fields |= {"learner": TD3Config(network=NetworkConfig((4,))), "buffer_capacity": 2000}

    @jax.jit
    def steps(key):
        racing, resting = kind(ENV, **fields), kind(ENV, **{**fields, "race": RaceConfig()})
        _, metrics = racing.step(racing.init(key))
        _, without = resting.step(resting.init(key))
        return metrics["environment_steps"], without["environment_steps"], received[-1][2]

    counted, without, of_race = jax.device_get(steps(jax.random.key(7)))
    assert counted == without + of_race
    assert of_race >= FINALISTS * MORE


# Who meets which worlds


def starts(config: SearchConfig) -> np.ndarray:
    """Where the first POI is in each world of a generation, team by team."""
    search = TeamSearch(ENV, CODEC, config)

    @jax.jit
    def draw(key):
        lineup = search.lineup(search.init(key), search.start(key), make_team)
        return lineup.start.state.poi_position[0, 0]

    return np.asarray(draw(jax.random.key(6))).reshape(config.population, EPISODES)


def test_all_teams_meet_the_same_worlds() -> None:
    worlds = starts(CONFIG)
    assert (worlds == worlds[:1]).all()
    assert len(np.unique(worlds)) == EPISODES


PAIRED = dataclasses.replace(CONFIG, population=8, evolver="strategy", episodes_shared_by="pair")


def test_each_mirrored_pair_meets_worlds_of_its_own() -> None:
    worlds = starts(PAIRED)
    np.testing.assert_array_equal(worlds[:4], worlds[4:])
    assert len(np.unique(worlds)) == 4 * EPISODES


def test_fitness_is_of_the_worlds_that_a_team_met() -> None:
    search = TeamSearch(ENV, CODEC, PAIRED)
    told = []
    search._evolver.next_generation = lambda key, state, fitness, evaluations: told.append(fitness) or state

    @jax.jit
    def generation(key):
        state = search.init(key)
        lineup = search.lineup(state, search.start(jax.random.key(1)), make_team)
        episodes, _ = rollout(ENV, lineup, jax.random.key(2), recorded=slice(0))
        search.evolve(key, state, episodes, make_team)
        return told[-1], search._evolver.genomes(state)

    fitness, genomes = jax.device_get(generation(jax.random.key(8)))
    keys = jax.random.split(jax.random.key(1), 4 * EPISODES)
    worlds = ActorWorlds(ENV)
    for team, genome in enumerate(genomes):
        mine = keys[team % 4 * EPISODES :][:EPISODES]
        (lived,) = worlds.episodes([CODEC.decode(jnp.asarray(genome))], mine)
        expected = np.mean([discounted(episode, DISCOUNT) for episode in lived])
        assert fitness[team] == pytest.approx(expected, rel=1e-4)
    assert len(np.unique(fitness)) > 3
