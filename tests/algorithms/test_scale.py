"""What is ranked alone does not care for the scale of the team reward: the same search, bit by bit."""

import dataclasses
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import skillcrew as sc
from oracles.two_phases import TwoPhases
from skillcrew.evolution.strategy import StrategyConfig
from skillcrew.experiment.config import RunConfig, to_yaml
from skillcrew.policies.memory import PolicyConfig

GENERATIONS = 5
EVERY = ((1.0, 0.0), (128.0, 0.0), (100.0, 0.0), (1.0, -50.0), (0.015625, 3.0))
"""Factors of the return, and what is then added to each episode's."""
FACTORS = ((1.0, 0.0), (128.0, 0.0), (0.015625, 0.0))
"""Powers of two, by which averages change without rounding."""

RANKED: dict[str, Any] = {"lineage_memory": 1.0, "lineage_prior": 0.0, "champion_prior": 0.0}
"""Fitness is the last return itself, with nothing to round."""


class Paid(TwoPhases):
    """The team reward on another scale. It comes at the end of episodes that are all of one length."""

    def __init__(self, times: Any, plus: Any):
        self._times, self._plus = times, plus

    def step(self, state, action, key):
        state, step = super().step(state, action, key)
        paid = jnp.where(step.terminated, self._times * step.team_reward + self._plus, 0.0)
        return state, dataclasses.replace(step, team_reward=paid)


def ea(evolver: str, evolution: sc.EvolutionConfig, **fields: Any) -> Callable[[Any], Any]:
    actor = PolicyConfig(hidden=(4,), memory=3)
    common = {"population": 12, "episodes": 1, "fitness_discount": 1.0, "actor": actor}
    return lambda env: sc.EA(env, evolver=evolver, evolution=evolution, **common, **fields)


LITTLE = sc.TD3Config(batch_size=8, network=sc.NetworkConfig(hidden=(4,)))


def with_skills(kind: Any, **fields: Any) -> Callable[[Any], Any]:
    """One whose skills, or actors, learn beside the search on rewards that are not scaled."""
    common = {"population": 12, "episodes": 2, "fitness_discount": 1.0, "updates": 2, "learner": LITTLE}
    return lambda env: kind(env, **common, **fields)


BREEDING = sc.EvolutionConfig(elites=2, restart=sc.RestartConfig(patience=2))
CASES: dict[str, tuple[Callable[[Any], Any], tuple[tuple[float, float], ...]]] = {
    "genetic": (ea("genetic", sc.EvolutionConfig(elites=2, **RANKED)), EVERY),
    "genetic, priors": (ea("genetic", sc.EvolutionConfig(elites=2, challengers=2)), FACTORS),
    "genetic, proportional": (
        ea("genetic", sc.EvolutionConfig(elites=2, selection="proportional")),
        FACTORS,
    ),
    "strategy": (
        ea("strategy", sc.EvolutionConfig(), strategy=StrategyConfig(patience=2, tolerance=0.25)),
        EVERY,
    ),
    "coevolution": (
        ea(
            "coevolution",
            sc.EvolutionConfig(elites=2, **RANKED),
            coevolution=sc.CoevolutionConfig(teams=2, hall_of_fame=sc.HallOfFameConfig(size=3)),
        ),
        EVERY,
    ),
    "mfl": (with_skills(sc.MFL, probe_episodes=2, pretraining_steps=300, evolution=BREEDING), FACTORS),
    "madys-plus": (
        with_skills(
            sc.MADySPlus,
            probe_episodes=1,
            evolution=BREEDING,
            selector=sc.SelectorConfig(hidden=(), phases=3, reactive=True, alike=0.5),
        ),
        FACTORS,
    ),
    "merl": (with_skills(sc.MERL, evolution=BREEDING, learner_episodes=1), FACTORS),
}


@pytest.mark.parametrize(("make", "scales"), CASES.values(), ids=CASES)
def test_a_search_is_the_same_on_any_scale(make, scales) -> None:
    @jax.jit
    def trained(times, plus):
        # One program for all scales, which the environment is made with while it is traced.
        algorithm = make(Paid(times, plus))
        evolver = getattr(algorithm, "_migration", algorithm)._search._evolver
        state = jax.jit(algorithm.init)(jax.random.key(3))
        first = evolver.genomes(state.search)
        state, metrics = jax.lax.scan(lambda carry, _: algorithm.step(carry), state, length=GENERATIONS)
        bred = evolver.genomes(state.search)
        return first, bred, algorithm.team(state), metrics["fitness_best"], metrics["fitness_mean"]

    results = [trained(jnp.float32(times), jnp.float32(plus)) for times, plus in scales]
    first, bred, team, best, mean = results[0]
    assert (best > mean).any(), "no team is better than another"
    assert (first != bred).any()
    for (times, plus), (_, scaled_bred, scaled_team, scaled_best, _) in zip(scales, results, strict=True):
        np.testing.assert_allclose(scaled_best, times * best + plus, rtol=1e-5)
        np.testing.assert_array_equal(scaled_bred, bred)
        jax.tree.map(np.testing.assert_array_equal, scaled_team, team)


def test_the_level_of_restarts_is_the_environments_to_know() -> None:
    """0.8 and 0.4 where it says what success is, none elsewhere, and whatever the user gives."""
    successful = sc.make("rover-t2-c2")
    unknown = TwoPhases()
    for env, level, average in ((successful, 0.8, 0.4), (unknown, None, None)):
        plus = sc.MADySPlus(env, selector=sc.SelectorConfig(phases=4))
        assert plus.config.evolution.restart.below == level
        assert sc.MADySES(env).config.strategy.restart_below == average
    own = sc.EvolutionConfig(restart=sc.RestartConfig(patience=5, below=-20.0))
    for env in (successful, unknown):
        assert sc.EA(env, evolution=own).config.evolution.restart.below == -20.0
    # What is not looked at is in no configuration file, filled in or not.
    assert "strategy" not in to_yaml(sc.EA(successful), RunConfig())
