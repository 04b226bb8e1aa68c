"""One generation of EA against loops, for plain actors and for one with memory that all agents share.

All numbers differ: 3 agents, 2 types, 5 episodes, 7 teams of which 4 are elites.
"""

import dataclasses
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from oracles.actors import ActorWorlds, discounted, steps_of
from skillcrew.algorithms.ea import EA, EAConfig, EAState
from skillcrew.envs.rover.config import RoverConfig
from skillcrew.envs.rover.world import RoverDomain
from skillcrew.evolution.genetic import EvolutionConfig
from skillcrew.experiment.generation import flat_arrays
from skillcrew.policies.memory import MemoryNetwork, PolicyConfig
from skillcrew.policies.population import GenomeCodec

AGENTS, EPISODES, TEAMS, ELITES = 3, 5, 7, 4
DISCOUNT = 0.8
WORLD = RoverConfig(
    n_agents=AGENTS,
    n_poi_types=2,
    spatial_coupling=2,
    world_size=5.0,
    episode_length=6,
    sensor_resolution=180,
    activation_distance=2.2,
    team_reward="fraction",
)
ACTORS = {
    "plain": PolicyConfig((8,), "sqrt"),
    "remembering and shared": PolicyConfig((8,), "sqrt", memory=6, sharing="team"),
}


def config_of(actor: str) -> EAConfig:
    return EAConfig(
        population=TEAMS,
        episodes=EPISODES,
        fitness_discount=DISCOUNT,
        evolution=EvolutionConfig(elites=ELITES),
        actor=ACTORS[actor],
    )


class Poisoned(RoverDomain):
    """The Rover Domain with other local rewards, by a number that one compiled program takes as input."""

    def __init__(self, local_factor: Any):
        super().__init__(WORLD)
        self.local_factor = local_factor

    def step_worlds(self, state, action, keys):
        state, step = super().step_worlds(state, action, keys)
        return state, dataclasses.replace(step, local_rewards=self.local_factor * step.local_rewards)


@dataclasses.dataclass
class Generation:
    """A first generation: what went in, what came out, and what the loops say of it."""

    ea: EA
    program: Any
    before: EAState
    after: EAState
    measured: dict[str, Any]
    teams: list[MemoryNetwork]
    lived: list

    @property
    def fitness(self) -> np.ndarray:
        return np.array([np.mean([discounted(one, DISCOUNT) for one in team]) for team in self.lived])


@pytest.fixture(scope="module", params=ACTORS)
def generation(request) -> Generation:
    config = config_of(request.param)
    ea = EA(RoverDomain(WORLD), config)
    program = jax.jit(lambda state, factor: EA(Poisoned(factor), config).step(state))
    before = jax.jit(ea.init)(jax.random.key(3))
    after, measured = program(before, 1.0)
    actor = config.actor
    codec = GenomeCodec(
        lambda key: MemoryNetwork.create(key, ea.env.observation_size, 2, actor), actor.networks(ea.env)
    )
    teams = [codec.decode(genome) for genome in before.search.genomes]
    start_keys = jax.random.split(jax.random.split(before.key, 4)[1], EPISODES)
    lived = ActorWorlds(ea.env).episodes(teams, start_keys)
    return Generation(ea, program, before, after, jax.device_get(measured), teams, lived)


def test_episodes_differ_in_length_and_teams_in_fitness(generation) -> None:
    assert len({len(episode) for team in generation.lived for episode in team}) > 1
    assert len(np.unique(generation.fitness)) > 2


def test_fitness_is_the_mean_discounted_team_return_of_each_team(generation) -> None:
    order = np.argsort(-generation.fitness, kind="stable")[:ELITES]
    evolver = generation.after.search
    np.testing.assert_allclose(evolver.lineage.mean[:ELITES], generation.fitness[order], rtol=1e-4)
    np.testing.assert_array_equal(
        evolver.genomes[:ELITES], generation.before.search.genomes[jnp.asarray(order)]
    )
    assert generation.measured["fitness_best"] == pytest.approx(generation.fitness.max(), rel=1e-4)
    assert generation.measured["fitness_mean"] == pytest.approx(generation.fitness.mean(), rel=1e-4)
    assert generation.measured["champion_fitness"] == pytest.approx(generation.fitness.max(), rel=1e-4)


def test_environment_steps_are_the_lived_ones_and_add_up(generation) -> None:
    first = generation.measured["environment_steps"]
    assert first == generation.after.environment_steps == steps_of(generation.lived)
    after, measured = generation.program(generation.after, 1.0)
    assert first + TEAMS * EPISODES <= measured["environment_steps"]
    assert measured["environment_steps"] <= first + TEAMS * EPISODES * WORLD.episode_length
    assert int(after.generation) == 2
    assert "race_steps" not in measured


def test_the_champion_is_the_fittest_and_acts_by_itself(generation) -> None:
    fittest = generation.teams[int(generation.fitness.argmax())]
    team = generation.ea.team(generation.after)
    for one, other in zip(jax.tree.leaves(team.actors), jax.tree.leaves(fittest), strict=True):
        np.testing.assert_array_equal(one, other)
    assert team.n_agents == AGENTS
    _, _, choice = team.act(
        jnp.ones((AGENTS, generation.ea.env.observation_size)), team.initial_memory(), jax.random.key(0)
    )
    # There are no skills: the one thing to choose is to act.
    assert choice.tolist() == [0] * AGENTS
    assert generation.ea.choices() == ("primitive_action",)


def test_local_rewards_never_reach_it(generation) -> None:
    other, measured = generation.program(generation.before, -50.0)
    assert set(measured) == {"environment_steps", "fitness_best", "fitness_mean", "champion_fitness"}
    theirs, ours = flat_arrays(other), flat_arrays(generation.after)
    assert all(np.array_equal(theirs[name], ours[name]) for name in ours)


def test_each_generation_has_start_worlds_of_its_own(generation) -> None:
    same_teams = dataclasses.replace(generation.after, search=generation.before.search)
    _, measured = generation.program(same_teams, 1.0)
    assert measured["environment_steps"] - generation.after.environment_steps != steps_of(generation.lived)
    assert measured["fitness_mean"] != generation.measured["fitness_mean"]
