"""MADyS and MFL over selectors that commit: what evolves, what it finds, and what is refused.

On a task of two phases, with skills that need no training: learning is other tests', and long to compile.
"""

import dataclasses
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import skillcrew as sc
from oracles.refusals import refusal, unhooked
from oracles.two_phases import AGENTS, DOWN, LENGTH, TURN, UP, TwoPhases
from skillcrew.algorithms import skill_teams
from skillcrew.algorithms.skill_learning import SkillLearning
from skillcrew.algorithms.skill_teams import SkillTeamsState
from skillcrew.evolution.phases import PhaseVariation

PHASES, SKILLS = 4, 3
SMALL: dict[str, Any] = {
    "population": 24,
    "episodes": 1,
    "fitness_discount": 1.0,
    "probe_episodes": 1,
    "updates": 2,
    "buffer_capacity": 2000,
    "evolution": sc.EvolutionConfig(elites=2),
    "learner": sc.TD3Config(network=sc.NetworkConfig(hidden=(3,))),
}


@pytest.fixture
def untrained(monkeypatch) -> None:
    monkeypatch.setattr(SkillLearning, "learn", lambda self, key, skills, *rest: (skills, {}))


def able(state: SkillTeamsState) -> SkillTeamsState:
    """The same with skills that do what they are called."""
    learners = state.skills.learners
    actor = jax.tree.map(jnp.zeros_like, learners.target_actor)
    biases = (*actor.network.biases[:-1], jnp.array([[5.0], [-5.0], [0.0]]))
    actor = dataclasses.replace(actor, network=dataclasses.replace(actor.network, biases=biases))
    learners = dataclasses.replace(learners, target_actor=actor)
    return dataclasses.replace(state, skills=dataclasses.replace(state.skills, learners=learners))


@jax.jit
def choices(team: Any) -> jax.Array:
    """[steps, agents]"""
    seen = jnp.ones((AGENTS, TwoPhases.observation_size))

    def step(memory, _):
        choice, memory = team.choose(seen, memory)
        return memory, choice

    return jax.lax.scan(step, team.initial_memory(), length=LENGTH)[1]


@pytest.mark.usefixtures("untrained")
def test_evolution_finds_what_to_do_first_and_what_then() -> None:
    selector = sc.SelectorConfig(phases=PHASES)
    madys = sc.MADyS(TwoPhases(), selector=selector, **SMALL)

    variation: Any = madys._search._evolver._variation
    assert (variation.networks, variation.phases, variation.skills) == (AGENTS, PHASES, SKILLS)
    assert variation.config is madys.config.evolution.phases

    @jax.jit
    def train(state):
        return jax.lax.scan(lambda state, _: madys.step(state), state, length=40)

    first = able(jax.jit(madys.init)(jax.random.key(0)))
    state, metrics = train(first)
    assert float(metrics["fitness_best"][0]) < 0.9
    assert float(metrics["fitness_best"][-1]) == pytest.approx(1.0)
    chosen = np.asarray(choices(madys.team(state)))
    assert (chosen[:TURN] == UP).all()
    assert (chosen[TURN + 1 :] == DOWN).all()
    # Four equal phases end at 2, 4, 7 and 9: no random team turns in time without luck.
    assert float(metrics["fitness_mean"][0]) < 0.5


# Evolvers


ONLY_LENGTHS = sc.PhaseMutationConfig(
    **dict.fromkeys(("skill", "copy", "block", "shift", "stretch", "teammate"), 0.0)
)


@pytest.mark.usefixtures("untrained")
def test_subpopulations_breed_by_what_knows_phases() -> None:
    """Where nothing but lengths may change, every phase keeps scores that were drawn at the beginning."""
    evolution = sc.EvolutionConfig(elites=2, challengers=1, phases=ONLY_LENGTHS)
    fields = {**SMALL, "population": 12, "evolution": evolution, "evolver": "coevolution"}
    selector = sc.SelectorConfig(phases=PHASES)
    # The first of three generations trains skills.
    algorithm = sc.MFL(TwoPhases(), selector=selector, pretraining_steps=1, **fields)
    traces = []

    @jax.jit
    def step(state):
        traces.append(1)
        return algorithm.step(state)

    first = state = jax.jit(algorithm.init)(jax.random.key(1))
    for _ in range(3):
        state, metrics = step(state)
    assert len(traces) == 1
    assert int(state.generation) == 3
    assert np.isfinite(float(metrics["champion_fitness"]))
    before, after = (np.asarray(one.search.subpopulations.genomes) for one in (first, state))
    assert before.shape == after.shape == (AGENTS, 12, PHASES * (SKILLS + 1))

    def phases_of(genomes):
        rows = genomes.reshape(-1, PHASES * (SKILLS + 1))
        scores, lengths = np.split(rows, [PHASES * SKILLS], axis=1)
        return scores.reshape(-1, PHASES, SKILLS), lengths

    (drawn, equal), (scores, lengths) = phases_of(before), phases_of(after)
    for phase in range(PHASES):
        assert {one.tobytes() for one in scores[:, phase]} <= {one.tobytes() for one in drawn[:, phase]}
    assert (equal == 1).all()
    assert (lengths != 1).any(1).mean() > 0.2
    # The borders have moved, and all episodes are as long as before.
    np.testing.assert_allclose(lengths.sum(1), PHASES, rtol=1e-5)
    assert choices(algorithm.team(state)).shape == (LENGTH, AGENTS)


@pytest.mark.parametrize("evolver", ["coevolution", "strategy"])
def test_every_evolver_can_carry_timetables(evolver: str) -> None:
    """Scores, lengths and weights are numbers; operators on phases are for those who make children.

    The genetic algorithm is above; for evosax see the tests of evolvers.
    """
    selector = sc.SelectorConfig(hidden=(3,), memory=2, phases=PHASES, reactive=True, hold=2, alike=0.5)
    fields = {**SMALL, "population": 12, "evolver": evolver}
    algorithm = sc.MADyS(TwoPhases(), selector=selector, **fields)
    evolver_in_use: Any = algorithm._search._evolver
    breeder = getattr(evolver_in_use, "_breeder", evolver_in_use)
    variation = getattr(breeder, "_variation", None)
    assert isinstance(variation, PhaseVariation) == (evolver == "coevolution")
    if variation is not None:
        assert (variation.networks, variation.phases, variation.skills) == (1, PHASES, SKILLS)
        assert variation.config is algorithm.config.evolution.phases
    assert algorithm._search._codec._alike == 0.5
    before = jax.eval_shape(algorithm.init, jax.random.key(0))
    after, metrics = jax.eval_shape(algorithm.step, before)
    assert jax.tree.map(lambda leaf: (leaf.shape, leaf.dtype), after) == jax.tree.map(
        lambda leaf: (leaf.shape, leaf.dtype), before
    )
    assert "champion_fitness" in metrics
    # A clock, what is kept and for how long, and two units of memory.
    assert jax.eval_shape(lambda state: algorithm.team(state).initial_memory(), before).shape == (AGENTS, 5)


def test_a_team_may_share_one_timetable() -> None:
    selector = sc.SelectorConfig(phases=PHASES, sharing="team")
    algorithm = sc.MADyS(TwoPhases(), selector=selector, **SMALL)
    assert algorithm._search._evolver._variation.networks == 1
    state = jax.eval_shape(algorithm.init, jax.random.key(0))
    team = jax.eval_shape(lambda state: algorithm.team(state), state)
    assert team.selectors.timetable.scores.shape == (1, PHASES, SKILLS)


def test_without_phases_weights_are_varied() -> None:
    assert not isinstance(sc.MADyS(TwoPhases(), **SMALL)._search._evolver._variation, PhaseVariation)


# Refusals


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        ({"phases": -1}, "selector.phases = -1: give a number of phases, or 0 for no timetable"),
        (
            {"reactive": True},
            "selector.reactive = True: there is no timetable to react on; set selector.phases to at least 1",
        ),
        ({"alike": -0.25}, "selector.alike = -0.25: give a probability between 0 and 1"),
        ({"alike": 1.5}, "selector.alike = 1.5: give a probability between 0 and 1"),
        ({"alike": float("nan")}, "selector.alike = nan: give a probability between 0 and 1"),
        ({"hold": 0}, "selector.hold = 0: give at least 1 step"),
        (
            {"phases": LENGTH + 1},
            "selector.phases = 10: an episode has 9 steps, and a phase at least one; give at most 9",
        ),
    ],
)
@pytest.mark.parametrize("kind", [sc.MADyS, sc.MFL, sc.MADySPlus], ids=lambda kind: kind.name)
def test_what_cannot_be_meant_is_refused_in_one_line(kind: Any, fields: Any, expected: str) -> None:
    def make() -> None:
        kind(TwoPhases(), selector=sc.SelectorConfig(**fields))

    assert refusal(make) == expected


def test_a_phase_for_each_step_is_allowed() -> None:
    sc.MADyS(TwoPhases(), selector=sc.SelectorConfig(phases=LENGTH, alike=1.0, hold=LENGTH), **SMALL)


def test_a_policys_configuration_is_a_selector_that_decides_at_every_step() -> None:
    """As it was all that there was to say of a selector once."""
    config = unhooked(skill_teams).SkillTeamsConfig(selector=sc.PolicyConfig((5,), memory=3, sharing="team"))
    assert config.selector == sc.SelectorConfig((5,), memory=3, sharing="team")
    committed = sc.SelectorConfig(phases=4)
    assert sc.SelectorConfig.of(committed) is committed
