"""Evolution strategies of evosax as the evolver of an algorithm, on a task whose best actions are known."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import skillcrew as sc
from experiment.meeting import Meeting
from oracles.aiming import AGENTS, TARGETS, Aiming
from oracles.refusals import refusal
from skillcrew.evolution.evosax_bridge import EVOSAX_NAMES
from skillcrew.policies.memory import PolicyConfig
from skillcrew.policies.network import NetworkConfig
from skillcrew.policies.selector import SelectorConfig

GENERATIONS = 150


def ea(**fields: Any) -> sc.EA:
    return sc.EA(Aiming(), **{"population": 40, "episodes": 1, "actor": PolicyConfig(hidden=(4,)), **fields})


def test_teams_learn_to_aim() -> None:
    def run(key):
        # Made while a program is traced, as a caller may.
        algorithm = ea(evolver="snes", evosax=sc.EvosaxConfig(deviation=0.15))
        state = algorithm.init(key)
        return jax.lax.scan(lambda carry, _: algorithm.step(carry), state, length=GENERATIONS)

    state, metrics = jax.jit(jax.vmap(run))(jax.random.split(jax.random.key(0), 2))
    assert (metrics["fitness_mean"][:, 0] < -0.5).all()
    assert (metrics["fitness_mean"][:, -5:] > -0.02).all()
    assert (metrics["champion_fitness"][:, -1] > -0.02).all()
    # The champion is the mean.
    algorithm = ea(evolver="snes")
    state = jax.device_get(state)
    say = jax.jit(lambda team: team.act(jnp.full((AGENTS, 4), 0.5), team.initial_memory(), jax.random.key(1)))
    for seed in range(2):
        one = jax.tree.map(lambda leaf, seed=seed: jnp.asarray(leaf[seed]), state)
        team = algorithm.team(one)
        action, _, _ = jax.device_get(say(team))
        np.testing.assert_allclose(action[:, 0], TARGETS, atol=0.2)
        genes = np.concatenate([np.ravel(leaf) for leaf in jax.tree.leaves(team.actors)])
        np.testing.assert_array_equal(np.sort(genes), np.sort(one.search.distribution.mean))


@pytest.mark.parametrize("evolver", EVOSAX_NAMES)
@pytest.mark.parametrize("kind", [sc.EA, sc.MADyS, sc.MFL], ids=lambda kind: kind.name)
def test_a_generation_takes_the_state_to_one_of_the_same_kind(kind: Any, evolver: str) -> None:
    network = {"hidden": (4,), "memory": 3}
    small = (
        {"actor": PolicyConfig(**network)}
        if kind is sc.EA
        else {"selector": SelectorConfig(**network, phases=5, reactive=True)}
    )
    algorithm = kind(Meeting(), evolver=evolver, population=6, **small)
    before = jax.eval_shape(algorithm.init, jax.random.key(0))
    after, metrics = jax.eval_shape(algorithm.step, before)
    like = jax.tree.map(lambda leaf: (leaf.shape, leaf.dtype, leaf.weak_type), before)
    assert jax.tree.map(lambda leaf: (leaf.shape, leaf.dtype, leaf.weak_type), after) == like
    assert "champion_fitness" in metrics


def test_what_cannot_be_evolved_so_is_refused() -> None:
    large = PolicyConfig(hidden=(60, 60))
    assert "set evolver to sep_cma_es" in refusal(ea, evolver="cma_es", actor=large)
    ea(evolver="sep_cma_es", actor=large)
    learner = sc.TD3Config(network=NetworkConfig(hidden=(4,)))
    for evolver in EVOSAX_NAMES:
        message = refusal(lambda evolver=evolver: sc.ERL(Aiming(), evolver=evolver, learner=learner))
        assert f"evolver = {evolver}" in message
        assert "set it to genetic or coevolution" in message
