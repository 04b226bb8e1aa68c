"""MADyS solves a small task that random teams hardly ever solve."""

import jax
import numpy as np
import pytest

from oracles.rover_cases import quick_jit
from skillcrew.algorithms.madys import MADyS, MADySConfig
from skillcrew.envs.rover.config import RoverConfig
from skillcrew.envs.rover.world import RoverDomain
from skillcrew.evolution.genetic import EvolutionConfig
from skillcrew.learners.td3 import TD3Config
from skillcrew.policies.network import NetworkConfig

WORLD = RoverConfig(n_agents=1, n_poi_types=2, world_size=12.0, episode_length=25, activation_distance=1.5)
CONFIG = MADySConfig(
    population=20,
    episodes=10,
    probe_episodes=3,
    updates=40,
    buffer_capacity=50_000,
    skills=("go_to_poi_A", "go_away_from_poi_A", "go_to_poi_B"),
    selector=NetworkConfig(hidden=(16,)),
    evolution=EvolutionConfig(elites=3),
    learner=TD3Config(batch_size=64, saturation_penalty=0.01, network=NetworkConfig(hidden=(32, 32))),
)
ROUNDS, GENERATIONS = 10, 25
"""Calls of the compiled program, and generations in each."""


@pytest.fixture(scope="module")
def history() -> dict[str, np.ndarray]:
    """Every metric over all generations."""
    madys = MADyS(RoverDomain(WORLD), CONFIG)

    @quick_jit
    def train(state):
        return jax.lax.scan(lambda state, _: madys.step(state), state, length=GENERATIONS)

    state, measured = madys.init(jax.random.key(0)), []
    for _ in range(ROUNDS):
        state, metrics = train(state)
        measured.append(jax.device_get(metrics))
    return {name: np.concatenate([metrics[name] for metrics in measured]) for name in measured[0]}


def test_the_champion_beats_random_teams_by_far(history) -> None:
    random = history["fitness_mean"][0]
    assert random < 0.15
    champion = history["champion_fitness"][-GENERATIONS:].mean()
    assert champion > 0.6
    assert champion > 5 * random
    # Not the champion alone: the population follows.
    assert history["fitness_mean"][-GENERATIONS:].mean() > 2 * random + 0.2


@pytest.mark.parametrize("poi", ["A", "B"])
def test_skills_learn_to_reach_their_pois(history, poi: str) -> None:
    returns = history[f"return_go_to_poi_{poi}"]
    # With a discount of 0.9, a skill that stands at its POI from the start would earn about 7.
    assert returns[-GENERATIONS:].mean() > 4.5
    assert returns[-GENERATIONS:].mean() > returns[:3].mean() + 2
    away = history["return_go_away_from_poi_A"]
    assert away[-GENERATIONS:].mean() > away[:3].mean()
