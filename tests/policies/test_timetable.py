"""Selectors that commit, against plain loops over the steps of an episode.

All numbers differ: 3 agents, 5 phases, 4 skills, 6 numbers seen, 7 hidden units, 2 of memory.
"""

import functools
from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from oracles.recurrent import remember
from skillcrew.policies.actor import Actor
from skillcrew.policies.memory import MemoryNetwork, PolicyConfig
from skillcrew.policies.network import MLP, NetworkConfig
from skillcrew.policies.selector import HoldingSelector, Selector, SelectorConfig, create_selector
from skillcrew.policies.team import SkillTeam
from skillcrew.policies.timetable import Timetable, TimetableSelector

AGENTS, PHASES, SKILLS, OBSERVATION, HIDDEN, UNITS, ACTION = 3, 5, 4, 6, 7, 2, 1
STEPS = 20
"""An equal share is 4 steps, so that eighths of it fall on halves of a step."""
NETWORKS = {"feed-forward": 0, "recurrent": UNITS}


def ends_of(lengths: Sequence[float], steps: int) -> list[float]:
    """When phases are over, in exact arithmetic; halves of a step are rounded to the even one."""
    total, ends = Fraction(0), []
    for length in lengths:
        total += max(Fraction(float(length)), Fraction(0))
        ends.append(round(total * steps / len(lengths)))
    return [*ends[:-1], float("inf")]


def first_not_over(clock: float, ends: list[float]) -> int:
    return next(phase for phase, end in enumerate(ends) if clock < end)


def planned(skills: Sequence[int], lengths: Sequence[float], steps: int) -> list[int]:
    """The skill of each step."""
    ends = ends_of(lengths, steps)
    return [int(skills[first_not_over(step, ends)]) for step in range(steps)]


def timetable_of(skills: Sequence[int], lengths: Sequence[float]) -> Timetable:
    """Scores of which the skill's is the highest, and not by much."""
    scores = np.random.default_rng(0).uniform(-3, 1, (len(skills), SKILLS))
    scores[np.arange(len(skills)), skills] = 1.125
    return Timetable(jnp.asarray(scores, jnp.float32), jnp.asarray(lengths, jnp.float32))


def stacked(*modules: Any) -> Any:
    return jax.tree.map(lambda *leaves: jnp.stack(leaves), *modules)


def at(module: Any, index: int) -> Any:
    return jax.tree.map(lambda leaf: leaf[index], module)


def walk(selector: Any, observations: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Choices and memories of one selector, step by step, from the start of an episode."""

    def step(memory, observation):
        choice, memory = selector(observation, memory)
        return memory, (choice, memory)

    return jax.lax.scan(step, selector.initial_memory(), observations)[1]


choices_of = jax.jit(walk)


def open_loop(skills: Sequence[int], lengths: Sequence[float], steps: int = STEPS) -> list[int]:
    selector = TimetableSelector(timetable_of(skills, lengths), None, steps)
    return choices_of(selector, jnp.zeros((steps, OBSERVATION)))[0].tolist()


# Timetables


@pytest.mark.parametrize(
    ("lengths", "times"),
    [
        ((1, 1, 1, 1, 1), (4, 4, 4, 4, 4)),
        ((0.5, 2, 0.25, 1, 1), (2, 8, 1, 4, 5)),
        # Of no length, or of a negative one: left out, and the others are where they would be without.
        ((0.5, 0, -1, 2, 1), (2, 0, 0, 8, 10)),
        ((-3, 1, 0, 1, -2), (0, 4, 0, 4, 12)),
        ((0, 0, 0, 0, 0), (0, 0, 0, 0, 20)),
        # The last lasts to the end, whatever its length, unless the others have filled the episode.
        ((1, 0.5, 0.5, 0.5, 0), (4, 2, 2, 2, 10)),
        ((2, 2, 2, 2, 2), (8, 8, 4, 0, 0)),
        ((9, 1, 1, 1, 1), (20, 0, 0, 0, 0)),
        # In whole steps, halves to the even one: they end at 2, 4, 6 and 8 for 2.5, 3.5, 6.5 and 7.5.
        ((0.625, 0.25, 0.75, 0.25, 1), (2, 2, 2, 2, 12)),
    ],
)
def test_a_phase_lasts_as_long_as_its_length_says(lengths: Sequence[float], times: Sequence[int]) -> None:
    skills = (2, 0, 3, 1, 2)
    expected = [skill for skill, time in zip(skills, times, strict=True) for _ in range(time)]
    assert planned(skills, lengths, STEPS) == expected, "the oracle"
    assert open_loop(skills, lengths) == expected


@settings(max_examples=60)
@given(
    skills=st.lists(st.integers(0, SKILLS - 1), min_size=PHASES, max_size=PHASES),
    eighths=st.lists(st.integers(-4, 20), min_size=PHASES, max_size=PHASES),
)
def test_any_timetable_is_what_the_loop_makes_of_it(skills: list[int], eighths: list[int]) -> None:
    lengths = [eighth / 8 for eighth in eighths]
    assert open_loop(skills, lengths) == planned(skills, lengths, STEPS)


def test_shares_need_not_be_whole_steps() -> None:
    steps, rng = 23, np.random.default_rng(1)
    tried = 0
    for _ in range(40):
        skills, lengths = rng.integers(0, SKILLS, PHASES), rng.normal(0.8, 0.8, PHASES).astype(np.float32)
        exact = np.cumsum(lengths.clip(0).astype(np.float64)) * steps / PHASES
        if (np.abs(exact % 1 - 0.5) > 1e-4).all():
            assert open_loop(skills, lengths, steps) == planned(skills, lengths, steps)
            tried += 1
    assert tried > 30


def test_the_clock_is_all_that_a_timetable_remembers() -> None:
    selector = TimetableSelector(timetable_of((0, 1, 2, 3, 0), (1, 1, 1, 1, 1)), None, STEPS)
    assert selector.initial_memory().tolist() == [0]
    _, memories = choices_of(selector, jnp.ones((STEPS, OBSERVATION)))
    assert memories.tolist() == [[step + 1] for step in range(STEPS)]


@pytest.mark.parametrize("shared", [False, True])
def test_each_agent_goes_by_its_own_clock(shared: bool) -> None:
    skills = [(0, 1, 2, 3, 0), (3, 2, 1, 0, 3), (1, 1, 0, 2, 2)][: 1 if shared else AGENTS]
    selectors = [TimetableSelector(timetable_of(own, (1, 1, 1, 1, 1)), None, STEPS) for own in skills]
    team = skill_team(stacked(*selectors))
    clocks = jnp.array([[0.0], [9.0], [17.0]])
    choice, memory = jax.jit(SkillTeam.choose)(team, jnp.zeros((AGENTS, OBSERVATION)), clocks)
    assert choice.tolist() == [skills[0][0], skills[-1 if shared else 1][2], skills[-1][4]]
    assert memory.tolist() == [[1], [10], [18]]
    assert team.initial_memory().tolist() == [[0]] * AGENTS


@pytest.fixture(scope="module")
def random_timetables() -> Timetable:
    create = jax.vmap(lambda key: Timetable.create(key, PHASES, SKILLS))
    return jax.jit(create)(jax.random.split(jax.random.key(0), 2000))


def test_a_random_timetable_has_equal_lengths_and_any_skills(random_timetables) -> None:
    assert random_timetables.lengths.shape == (2000, PHASES)
    assert (random_timetables.lengths == 1).all()
    skills = np.asarray(random_timetables.scores).argmax(-1)
    for phase in (0, PHASES - 1):
        assert stats.chisquare(np.bincount(skills[:, phase], minlength=SKILLS)).pvalue > 1e-3
    np.testing.assert_array_equal(at(random_timetables, 7).skills(), skills[7])


def test_few_long_stretches_are_as_likely_as_many_short_ones(random_timetables) -> None:
    scores = np.asarray(random_timetables.scores)
    changes = (scores[:, 1:] != scores[:, :-1]).any(-1)
    # A probability that is uniform makes every number of changes as likely as another.
    assert stats.chisquare(np.bincount(changes.sum(1), minlength=PHASES)).pvalue > 1e-3
    np.testing.assert_allclose(changes.mean(0), 0.5, atol=0.05)


# Reactive ones


@functools.cache
def creation(memory: int) -> Any:
    config = PolicyConfig(hidden=(HIDDEN,), memory=memory, input_scaling="none")
    return jax.jit(lambda key: TimetableSelector.create(key, OBSERVATION, SKILLS, STEPS, PHASES, config))


def redrawn(module: Any, rng: np.random.Generator) -> Any:
    """The same with every number drawn: what starts at 0 would hide its use."""
    return jax.tree.map(lambda leaf: jnp.asarray(rng.normal(0, 0.7, leaf.shape), jnp.float32), module)


def reactive_selector(seed: int, memory: int, silent: bool) -> TimetableSelector:
    """With a network as it is created; or with one of which every number is drawn."""
    rng = np.random.default_rng(seed)
    network = creation(memory)(jax.random.key(seed)).network
    lengths = rng.integers(0, 14, PHASES) / 8
    timetable = timetable_of(rng.integers(0, SKILLS, PHASES), lengths)
    return TimetableSelector(timetable, network if silent else redrawn(network, rng), STEPS)


def skill_team(selectors: Any) -> SkillTeam:
    create = jax.vmap(lambda key: Actor.create(key, OBSERVATION, ACTION, NetworkConfig(hidden=(3,))))
    skills = jax.eval_shape(create, jax.random.split(jax.random.key(9), SKILLS))
    return SkillTeam(selectors, redrawn(skills, np.random.default_rng(9)), AGENTS)


def seen_in_an_episode(seed: int = 2) -> jax.Array:
    seen = np.random.default_rng(seed).normal(0, 1, (STEPS, AGENTS, OBSERVATION))
    return jnp.asarray(seen, jnp.float32)


@jax.jit
def episode(team: SkillTeam, seen: jax.Array) -> tuple[jax.Array, jax.Array, jax.Array]:
    """Actions, choices and memories."""

    def step(memory, observation):
        action, memory, choice = team.act(observation, memory, jax.random.key(0))
        return memory, (action, choice, memory)

    return jax.lax.scan(step, team.initial_memory(), seen)[1]


@pytest.mark.parametrize("memory", NETWORKS.values(), ids=NETWORKS)
@pytest.mark.parametrize("count", [AGENTS, 1])
def test_a_reactive_selector_begins_as_its_timetable(count: int, memory: int) -> None:
    selectors = [reactive_selector(seed, memory, silent=True) for seed in range(count)]
    alone = [TimetableSelector(selector.timetable, None, STEPS) for selector in selectors]
    action, choice, after = episode(skill_team(stacked(*selectors)), seen_in_an_episode())
    expected_action, expected, clock = episode(skill_team(stacked(*alone)), seen_in_an_episode())
    np.testing.assert_array_equal(action, expected_action)
    np.testing.assert_array_equal(choice, expected)
    np.testing.assert_array_equal(after[..., :1], clock)
    assert after.shape == (STEPS, AGENTS, 1 + memory)
    assert len(np.unique(choice)) > 1
    # Not because there is nothing to build upon: all but the last layer is drawn.
    network = selectors[0].network
    assert float(jnp.std(network.network.weights[0])) > 0.2
    if memory:
        assert len(np.unique(after[-1, :, 1:])) == AGENTS * UNITS


def react(selector: Any, observations: np.ndarray) -> tuple[list[int], list[float]]:
    """Choices and clocks of one selector, in a loop; and how sure each decision was."""
    skills = np.asarray(selector.timetable.scores).argmax(-1)
    ends = ends_of(selector.timetable.lengths, STEPS)
    clock, remembered = 0.0, np.zeros(selector.network.initial_memory().shape[0])
    choices, clocks = [], []
    for observation in observations:
        outputs, remembered = remember(selector.network, observation, remembered)
        interventions, terminations = outputs[:SKILLS], outputs[SKILLS:]
        phase = first_not_over(clock, ends)
        assert abs(terminations[skills[phase]] - 1) > 1e-4
        if terminations[skills[phase]] > 1 and phase < PHASES - 1:
            clock = ends[phase]
        scores = interventions + (np.arange(SKILLS) == skills[first_not_over(clock, ends)])
        assert np.diff(np.sort(scores)[-2:]) > 1e-4
        choices.append(int(scores.argmax()))
        clock += 1
        clocks.append(clock)
    return choices, clocks


@pytest.mark.parametrize("memory", NETWORKS.values(), ids=NETWORKS)
@pytest.mark.parametrize("count", [AGENTS, 1])
def test_what_a_network_says_is_what_the_loop_makes_of_it(count: int, memory: int) -> None:
    """Of each agent, from what it sees itself and from its own clock."""
    selectors = [reactive_selector(10 + seed, memory, silent=False) for seed in range(count)]
    seen = seen_in_an_episode()
    _, choice, after = episode(skill_team(stacked(*selectors)), seen)
    ended = overridden = 0
    for agent in range(AGENTS):
        own = selectors[agent % count]
        expected, clocks = react(own, np.asarray(seen[:, agent]))
        assert choice[:, agent].tolist() == expected
        assert after[:, agent, 0].tolist() == clocks
        ended += int((np.diff(clocks) > 1).sum())
        skills, ends = own.timetable.skills().tolist(), ends_of(own.timetable.lengths, STEPS)
        overridden += sum(
            chosen != skills[first_not_over(clock - 1, ends)]
            for chosen, clock in zip(expected, clocks, strict=True)
        )
    assert ended > 0
    assert overridden > 0


def saying(skills: Sequence[int], lengths: Sequence[float], outputs: dict[int, float]) -> TimetableSelector:
    """One whose network says the same whatever it sees."""
    silent = reactive_selector(0, 0, silent=True).network
    bias = np.zeros(2 * SKILLS, np.float32)
    for output, value in outputs.items():
        bias[output] = value
    layers = silent.network
    network = MemoryNetwork(MLP(layers.weights, (*layers.biases[:-1], jnp.asarray(bias))), None, "none")
    return TimetableSelector(timetable_of(skills, lengths), network, STEPS)


def said(selector: TimetableSelector, steps: int = STEPS) -> list[int]:
    return choices_of(selector, jnp.zeros((steps, OBSERVATION)))[0].tolist()


EQUAL = (1, 1, 1, 1, 1)


def test_an_intervention_overrides_the_timetable_while_its_clock_goes_on() -> None:
    skills = (0, 1, 2, 3, 0)
    plan = planned(skills, EQUAL, STEPS)
    assert said(saying(skills, EQUAL, {2: 0.9})) == plan, "the timetable's skill has 1"
    assert said(saying(skills, EQUAL, {2: 1.1})) == [2] * STEPS
    selector = saying(skills, EQUAL, {2: 1.1})
    assert choices_of(selector, jnp.zeros((STEPS, OBSERVATION)))[1][:, 0].tolist() == list(
        range(1, STEPS + 1)
    )
    # Against the timetable's skill alone.
    assert said(saying(skills, EQUAL, {1: -1.1})) == [0 if skill == 1 else skill for skill in plan]


def test_a_termination_begins_all_later_phases_earlier() -> None:
    skills = (0, 1, 2, 1, 3)
    assert said(saying(skills, EQUAL, {SKILLS + 1: 1.0})) == planned(skills, EQUAL, STEPS), "not above 1"
    # Its phases end where they begin.
    assert said(saying(skills, EQUAL, {SKILLS + 1: 1.1})) == [0] * 4 + [2] * 4 + [3] * 12
    # One phase after the other, at every step, and nothing beyond the last.
    every = {SKILLS + skill: 2.0 for skill in range(SKILLS)}
    assert said(saying((0, 1, 2, 0, 3), EQUAL, every)) == [1, 2, 0] + [3] * 17
    selector = saying((3, 3, 3, 3, 3), EQUAL, every)
    clocks = choices_of(selector, jnp.zeros((STEPS, OBSERVATION)))[1][:, 0]
    assert clocks.tolist() == [5, 9, 13, 17, *range(18, 34)]
    # Phases that are left out are not waited for.
    assert said(saying((0, 1, 2, 0, 3), (1, 0, -1, 1, 1), every)) == [0] + [3] * 19


def test_a_phase_that_was_entered_early_may_end_early_too() -> None:
    """Only the present phase is ended, and only by what is said of its own skill."""
    assert said(saying((0, 1, 2, 3, 1), EQUAL, {SKILLS: 2.0})) == [1] * 4 + [2] * 4 + [3] * 4 + [1] * 8
    assert said(saying((0, 0, 2, 3, 1), EQUAL, {SKILLS: 2.0})) == [0] + [2] * 4 + [3] * 4 + [1] * 11


# Choices that are kept


LONGEST = 24


def held(wanted: Sequence[int], hold: int) -> list[int]:
    """Each choice is kept for at least `hold` steps; then it changes as soon as another one is wanted."""
    choices, age = [], hold
    for skill in wanted:
        if not choices or (age >= hold and skill != choices[-1]):
            choices.append(int(skill))
            age = 1
        else:
            choices.append(choices[-1])
            age += 1
    return choices


def runs(choices: Sequence[int]) -> list[int]:
    borders = np.flatnonzero(np.diff(choices)) + 1
    return np.diff([0, *borders, len(choices)]).tolist()


def wishing() -> Selector:
    """Wants the skill that it is shown."""
    eye = jnp.eye(SKILLS)
    return Selector(MemoryNetwork(MLP((eye, eye), (jnp.zeros(SKILLS),) * 2), None, "none"))


@pytest.mark.parametrize("hold", [1, 2, 7])
@settings(max_examples=50)
@given(wanted=st.lists(st.integers(0, SKILLS - 1), min_size=1, max_size=LONGEST))
def test_a_choice_is_kept_for_a_while_and_no_longer_than_it_must(hold: int, wanted: list[int]) -> None:
    shown = np.zeros((LONGEST, SKILLS), np.float32)
    shown[np.arange(LONGEST), (wanted * LONGEST)[:LONGEST]] = 1
    choices = choices_of(HoldingSelector(wishing(), hold), jnp.asarray(shown))[0].tolist()[: len(wanted)]
    assert choices == held(wanted, hold)
    assert all(run >= hold for run in runs(choices)[:-1])
    assert choices[0] == wanted[0]


INNER = {
    "feed-forward": SelectorConfig(hidden=(HIDDEN,)),
    "recurrent": SelectorConfig(hidden=(HIDDEN,), memory=UNITS),
    "timetable": SelectorConfig(phases=PHASES),
    "reactive": SelectorConfig(hidden=(HIDDEN,), memory=UNITS, phases=PHASES, reactive=True),
}


@pytest.mark.parametrize("kind", INNER)
def test_what_the_selector_remembers_goes_on_while_a_choice_is_kept(kind: str) -> None:
    hold, count = 3, 8
    config = INNER[kind]
    create = jax.vmap(lambda key: create_selector(key, OBSERVATION, SKILLS, STEPS, config))
    # Phases are shorter than a choice is kept for, or left out.
    shapes = jax.eval_shape(create, jax.random.split(jax.random.key(1), count))
    inner = redrawn(shapes, np.random.default_rng(4))
    seen = jnp.asarray(np.random.default_rng(3).normal(0, 2, (count, STEPS, OBSERVATION)), jnp.float32)

    @jax.jit
    @jax.vmap
    def both(inner, seen):
        return walk(inner, seen), walk(HoldingSelector(inner, hold), seen)

    (wanted, remembered), (choices, memory) = both(inner, seen)
    for one in range(count):
        assert choices[one].tolist() == held(wanted[one].tolist(), hold)
    np.testing.assert_allclose(memory[:, :, 2:], remembered, rtol=1e-6)
    assert (wanted != choices).any()
    start = HoldingSelector(at(inner, 0), hold).initial_memory()
    assert start.shape == (2 + remembered.shape[-1],)


# What a configuration makes


def test_a_configuration_says_which_selector_it_is() -> None:
    def of(**fields: Any) -> Any:
        config = SelectorConfig(hidden=(HIDDEN,), **fields)
        create = functools.partial(create_selector, config=config)
        return jax.eval_shape(lambda key: create(key, OBSERVATION, SKILLS, STEPS), jax.random.key(0))

    assert type(of()) is Selector
    assert of(memory=UNITS).network.unit.hidden_size == UNITS
    alone, reactive = of(phases=PHASES), of(phases=PHASES, reactive=True, memory=UNITS)
    assert type(alone) is type(reactive) is TimetableSelector
    assert alone.timetable.scores.shape == (PHASES, SKILLS)
    assert (alone.episode_length, alone.timetable.n_skills) == (STEPS, SKILLS)
    assert alone.network is None
    assert reactive.network.network.weights[-1].shape == (HIDDEN, 2 * SKILLS)
    assert reactive.network.unit.hidden_size == UNITS
    holding = of(phases=PHASES, hold=4)
    assert (type(holding), type(holding.selector), holding.steps) == (HoldingSelector, TimetableSelector, 4)
    assert type(of(hold=2).selector) is Selector
