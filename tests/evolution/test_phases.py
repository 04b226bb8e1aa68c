"""What each change of timetables may touch and what it must leave, against the rules in NumPy.

All numbers differ: 3 agents, 5 phases, 4 skills, 6 weights of a network behind each timetable.
"""

import dataclasses
import types
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import stats

from oracles.refusals import refusal, unhooked
from skillcrew.evolution import phases as module
from skillcrew.evolution.phases import (
    PhaseMutationConfig,
    PhaseVariation,
    Timetables,
    change_skills,
    copy_neighbour,
    cut_in_time,
    move_border,
    set_block,
    shift,
    stretch,
)
from skillcrew.evolution.rules import TAKEN_AWAY
from skillcrew.policies.memory import PolicyConfig
from skillcrew.policies.population import GenomeCodec
from skillcrew.policies.timetable import TimetableSelector

AGENTS, PHASES, SKILLS, WEIGHTS, CASES = 3, 5, 4, 6, 600
ROW = PHASES * SKILLS + PHASES + WEIGHTS
"""Genes of one agent."""
DEVIATION = 0.6
CHANCES = ("skill", "copy", "block", "shift", "length", "stretch", "teammate", "network", "rule")
"""Each operator's probability, in `PhaseMutationConfig`."""
NONE = PhaseMutationConfig(**dict.fromkeys(CHANCES, 0.0))
SHARES = {"network_share": 0.4, "rule_share": 0.4}


STACKED = jax.vmap(Timetables)


def drawn_timetables(seed: int) -> Timetables:
    """Lengths of 0 among them."""
    rng = np.random.default_rng(seed)
    scores = rng.normal(0, 1, (CASES, AGENTS, PHASES, SKILLS)).astype(np.float32)
    lengths = rng.uniform(-0.3, 2.0, (CASES, AGENTS, PHASES)).clip(0).astype(np.float32)
    return STACKED(jnp.asarray(scores), jnp.asarray(lengths))


OLD = drawn_timetables(0)
KEYS = jax.random.split(jax.random.key(0), CASES)


def skills_of(timetables: Timetables) -> np.ndarray:
    return np.asarray(timetables.scores).argmax(-1)


OPERATORS: dict[str, Callable[..., Timetables]] = {
    "skill": change_skills,
    "copy": copy_neighbour,
    "block": set_block,
    "shift": shift,
    "length": lambda key, old: move_border(key, old, DEVIATION),
    "stretch": lambda key, old: stretch(key, old, DEVIATION),
}


@pytest.fixture(scope="module")
def after() -> dict[str, Timetables]:
    """What each operator makes of many teams, all in one program."""
    return jax.jit(
        lambda keys, old: {name: jax.vmap(operator)(keys, old) for name, operator in OPERATORS.items()}
    )(KEYS, OLD)


def changed_phases(new: Timetables) -> np.ndarray:
    """[cases, phases]: where the scores are others, of every agent alike."""
    changed = (np.asarray(new.scores) != np.asarray(OLD.scores)).any(-1)
    assert (changed == changed[:, :1]).all(), "it is one change of all who are changed"
    return changed[:, 0]


def evenly(values: Any, outcomes: int) -> None:
    """Every outcome is as likely as another."""
    counts = np.bincount(np.asarray(values).astype(int), minlength=outcomes)
    assert len(counts) == outcomes
    assert stats.chisquare(counts).pvalue > 1e-3


@pytest.mark.parametrize("name", ["skill", "copy", "block"])
def test_changes_of_skills_leave_all_lengths(after, name: str) -> None:
    np.testing.assert_array_equal(after[name].lengths, OLD.lengths)


@pytest.mark.parametrize("name", ["length", "stretch"])
def test_changes_of_lengths_leave_all_skills(after, name: str) -> None:
    np.testing.assert_array_equal(after[name].scores, OLD.scores)
    assert (np.asarray(after[name].lengths) >= 0).all()


def test_another_skill_in_one_phase_or_two(after) -> None:
    changed = changed_phases(after["skill"])
    # Two phases are drawn, one fifth of the time the same.
    assert set(changed.sum(1)) == {1, 2}
    assert (changed.sum(1) == 1).mean() == pytest.approx(1 / PHASES, abs=0.06)
    evenly(np.nonzero(changed)[1], PHASES)
    to = skills_of(after["skill"])[:, 0][changed]
    evenly(to, SKILLS)
    # Two phases need not get the same.
    two = skills_of(after["skill"])[changed.sum(1) == 2, 0][changed[changed.sum(1) == 2]].reshape(-1, 2)
    assert (two[:, 0] == two[:, 1]).mean() == pytest.approx(1 / SKILLS, abs=0.08)


def test_a_phase_takes_over_a_neighbours_skill(after) -> None:
    old, new = skills_of(OLD), skills_of(after["copy"])
    before, later = (np.roll(old, by, axis=2) for by in (1, -1))
    changed = changed_phases(after["copy"])
    assert set(changed.sum(1)) == {0, 1}
    # At the ends there is a neighbour on one side only.
    assert (changed.sum(1) == 0).mean() == pytest.approx(1 / PHASES, abs=0.06)
    assert changed.any(0).all()
    where = np.broadcast_to(changed[:, None], old.shape)
    assert ((new == before) | (new == later))[where].all()
    assert (new == before)[where].mean() > 0.4
    assert (new == later)[where].mean() > 0.4
    assert (new[:, :, 0] == old[:, :, 1])[changed[:, 0]].all(), "the first has no neighbour before it"
    assert (new[:, :, -1] == old[:, :, -2])[changed[:, -1]].all()


def test_a_block_is_one_skill_in_phases_in_a_row(after) -> None:
    changed = changed_phases(after["block"])
    assert ((np.diff(changed.astype(int), axis=1, prepend=0) == 1).sum(1) == 1).all()
    new = skills_of(after["block"])
    assert all(len(set(new[case][:, changed[case]].ravel())) == 1 for case in range(CASES))
    evenly(new[:, 0][np.arange(CASES), changed.argmax(1)], SKILLS)
    # Between two places drawn independently: n of 25 pairs for one phase, twice as many as fit for more.
    expected = np.array([PHASES, *(2 * (PHASES - length) for length in range(1, PHASES))]) / PHASES**2
    counts = np.bincount(changed.sum(1) - 1, minlength=PHASES)
    assert stats.chisquare(counts, CASES * expected).pvalue > 1e-3


def test_a_shift_moves_phases_with_their_lengths_and_doubles_an_end(after) -> None:
    place = np.arange(PHASES)
    moved = []
    for case in range(CASES):
        fits = [
            by
            for by in (-2, -1, 1, 2)
            if all(
                np.array_equal(
                    getattr(after["shift"], field)[case],
                    np.asarray(getattr(OLD, field))[case][:, (place - by).clip(0, PHASES - 1)],
                )
                for field in ("scores", "lengths")
            )
        ]
        assert len(fits) == 1
        moved.append((-2, -1, 1, 2).index(fits[0]))
    evenly(moved, 4)


def test_a_moved_border_leaves_the_total_and_all_but_two_lengths(after) -> None:
    old, new = np.asarray(OLD.lengths), np.asarray(after["length"].lengths)
    np.testing.assert_allclose(new.sum(-1), old.sum(-1), rtol=1e-5)
    change = new - old
    changed = change != 0
    assert set(changed.sum(-1).ravel()) <= {0, 2}
    somewhere = changed.any(1)
    first = somewhere.argmax(1)[somewhere.any(1)]
    evenly(first, PHASES - 1)
    for case in range(CASES):
        if somewhere[case].any():
            border = somewhere[case].argmax()
            assert not np.delete(somewhere[case], [border, border + 1]).any()
    # Where no length was in the way, by a normal number.
    by = np.array([one[one != 0][0] for one, free in zip(change[:, 0], (new[:, 0] > 0).all(-1), strict=True)
                   if free and (one != 0).any()])  # fmt: skip
    assert 0.3 * DEVIATION < by.std() < 1.1 * DEVIATION
    assert 0.3 < (by > 0).mean() < 0.7
    # It goes as far as a length of nothing, and no further.
    assert ((new == 0) & (old > 0)).any()


def test_a_stretched_phase_moves_all_later_ones_by_as_much(after) -> None:
    old, new = np.asarray(OLD.lengths), np.asarray(after["stretch"].lengths)
    changed = (new != old).any(1)
    assert set(changed.sum(1)) <= {0, 1}
    # Only a phase of nothing that was to be shorter yet stays as it is.
    assert (changed.sum(1) == 1).mean() > 0.9
    evenly(np.nonzero(changed)[1], PHASES)
    by = (new - old)[:, 0][changed & (new[:, 0] > 0)]
    assert by.std() == pytest.approx(DEVIATION, rel=0.2)
    assert ((new == 0) & (old > 0)).any()


def test_a_lone_phase_has_no_neighbour_and_no_border() -> None:
    lone = Timetables(OLD.scores[0, :, :1], OLD.lengths[0, :, :1])
    alone = ("copy", "shift", "length")
    after = jax.jit(lambda key: [OPERATORS[name](key, lone) for name in alone])(jax.random.key(1))
    for one in after:
        np.testing.assert_array_equal(one.scores, lone.scores)
        np.testing.assert_array_equal(one.lengths, lone.lengths)


# Crossover


def ends_of(lengths: Any) -> np.ndarray:
    return np.cumsum(np.maximum(np.asarray(lengths, np.float64), 0), axis=-1)


def test_a_cut_in_time_keeps_when_phases_end() -> None:
    first, second = drawn_timetables(1), drawn_timetables(2)
    # Lengths below 0 count as 0.
    second = STACKED(second.scores, second.lengths - 0.2)
    cuts = jnp.asarray(np.arange(CASES) % (PHASES - 1) + 1)
    child = jax.jit(jax.vmap(cut_in_time))(cuts, first, second)
    early = np.arange(PHASES) < np.asarray(cuts)[:, None]
    np.testing.assert_array_equal(
        child.scores, np.where(early[:, None, :, None], first.scores, second.scores)
    )
    ends, own, other = ends_of(child.lengths), ends_of(first.lengths), ends_of(second.lengths)
    assert (np.asarray(child.lengths) >= 0).all()
    for case, cut in enumerate(np.asarray(cuts)):
        np.testing.assert_allclose(ends[case, :, :cut], own[case, :, :cut], atol=1e-5)
        at = own[case, :, cut - 1 : cut]
        # What the second's phases would have ended before the cut is left out.
        np.testing.assert_allclose(ends[case, :, cut:], np.maximum(other[case, :, cut:], at), atol=1e-5)
    assert (np.diff(ends, axis=-1)[other[..., 1:] < own[..., :-1]] == 0).any()


def genomes_of(seed: int, cases: int = CASES) -> jax.Array:
    """Genomes as they are laid out: scores, lengths, and then weights, agent by agent."""
    timetables = drawn_timetables(seed)
    weights = np.random.default_rng(seed + 50).normal(0, 1, (CASES, AGENTS, WEIGHTS))
    parts = (timetables.scores.reshape(CASES, AGENTS, -1), timetables.lengths, weights.astype(np.float32))
    return jnp.concatenate([jnp.asarray(part) for part in parts], axis=-1).reshape(CASES, -1)[:cases]


def parts_of(genomes: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rows = np.asarray(genomes).reshape(len(genomes), AGENTS, ROW)
    scores, lengths, weights = np.split(rows, [PHASES * SKILLS, PHASES * SKILLS + PHASES], axis=-1)
    return scores.reshape(len(genomes), AGENTS, PHASES, SKILLS), lengths, weights


def variation(config: PhaseMutationConfig = NONE) -> PhaseVariation:
    return PhaseVariation(config, AGENTS, PHASES, SKILLS)


def test_a_child_has_a_cut_at_any_border_and_the_networks_of_one_parent() -> None:
    first, second = genomes_of(3), genomes_of(4)
    child = jax.jit(variation().crossover)(jax.random.key(2), first, second)
    scores, _, weights = parts_of(child)
    (one, _, one_weights), (other, _, other_weights) = parts_of(first), parts_of(second)
    of_first, of_second = ((scores == parent).all((1, 3)) for parent in (one, other))
    assert (of_first ^ of_second).all(), "a phase's numbers are never cut apart, and all agents are cut alike"
    cuts = of_first.sum(1)
    assert (of_first == (np.arange(PHASES) < cuts[:, None])).all()
    # From 1 to one less than all.
    evenly(cuts - 1, PHASES - 1)
    whole = (weights == one_weights).all((1, 2))
    assert (whole ^ (weights == other_weights).all((1, 2))).all()
    assert whole.mean() == pytest.approx(0.5, abs=0.08)
    parents = [STACKED(*map(jnp.asarray, parts_of(parent)[:2])) for parent in (first, second)]
    expected = jax.vmap(cut_in_time)(jnp.asarray(cuts), *parents)
    np.testing.assert_allclose(parts_of(child)[1], expected.lengths, atol=1e-6)


def test_genomes_are_what_selectors_are_turned_into() -> None:
    """Scores, lengths and weights are where the codec has them, or phases would be cut apart."""
    config = PolicyConfig(hidden=(3,))
    codec = GenomeCodec(lambda key: TimetableSelector.create(key, 2, SKILLS, 20, PHASES, config), AGENTS)
    genome = jnp.arange(float(codec.n_genes))
    selectors = codec.decode(genome)
    timetables, weights = PhaseVariation(NONE, AGENTS, PHASES, SKILLS)._split(genome)
    np.testing.assert_array_equal(timetables.scores, selectors.timetable.scores)
    np.testing.assert_array_equal(timetables.lengths, selectors.timetable.lengths)
    first = np.asarray(selectors.network.network.weights[0]).reshape(AGENTS, -1)
    np.testing.assert_array_equal(weights[:, : first.shape[1]], first)
    np.testing.assert_array_equal(variation()._join(timetables, weights), genome)


# Which operators, and whose timetables


KIN = 2
"""The first two agents follow the same."""


def kindred(seed: int = 5) -> jax.Array:
    rows = np.array(genomes_of(seed)).reshape(CASES, AGENTS, ROW)
    rows[:, 1] = rows[:, 0]
    return jnp.asarray(rows.reshape(CASES, -1))


GENOMES = kindred()


def mutate_by(
    configs: dict[str, PhaseMutationConfig], genomes: jax.Array, agents: int, judged: bool = True
) -> dict[str, Any]:
    """The genomes changed by each configuration, and which of them changed.

    One program for all: it takes the numbers of a configuration as inputs.
    """
    names = [field.name for field in dataclasses.fields(NONE)]
    values = [[float(getattr(config, name)) for name in names] for config in configs.values()]

    def mutate(key, values):
        one = unhooked(module).PhaseVariation(NONE, agents, PHASES, SKILLS)
        one.config = types.SimpleNamespace(**dict(zip(names, values, strict=True)))
        return one.mutate(key, genomes, judged)

    keys = jax.random.split(jax.random.key(3), len(configs))
    after, changed = jax.device_get(jax.jit(jax.vmap(mutate))(keys, jnp.asarray(values)))
    return dict(zip(configs, zip(after, changed, strict=True), strict=True))


@pytest.fixture(scope="module")
def mutated() -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """By what is certain to happen, everything else never; and by half a chance of each operator alone."""
    configs = {"none": NONE}
    for name in CHANCES:
        configs[name] = dataclasses.replace(NONE, **{name: 1.0}, together=1.0, group=0.0, **SHARES)
        configs[name + " at half"] = dataclasses.replace(configs[name], **{name: 0.5})
    whole = {"skill": 1.0, "network": 1.0, **SHARES}
    configs["group"] = dataclasses.replace(NONE, **whole, together=0.0, group=1.0)
    configs["part"] = dataclasses.replace(NONE, **whole, together=0.0, group=0.0)
    configs["mixed"] = dataclasses.replace(NONE, block=1.0, together=0.5, group=0.3)
    configs["skill and length"] = dataclasses.replace(configs["length at half"], skill=0.5)
    for scope in ("group", "part"):
        alone = {"skill": 0.0, "network": 0.0, "teammate": 1.0}
        configs["teammate, " + scope] = dataclasses.replace(configs[scope], **alone)
    for share in (0.0, 0.02, 1.0):
        configs[f"share {share}"] = dataclasses.replace(configs["network"], network_share=share)
    return mutate_by(configs, GENOMES, AGENTS)


def test_nothing_happens_without_a_chance(mutated) -> None:
    after, changed = mutated["none"]
    np.testing.assert_array_equal(after, GENOMES)
    assert not changed.any()


def test_what_changed_is_told(mutated) -> None:
    for after, changed in mutated.values():
        np.testing.assert_array_equal(changed, (after != np.asarray(GENOMES)).any(1))


def changes(after: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Where scores, lengths and weights are others."""
    pairs = zip(parts_of(after), parts_of(GENOMES), strict=True)
    return tuple(new != old for new, old in pairs)


@pytest.mark.parametrize("name", ["skill", "copy", "block", "shift"])
def test_a_certain_change_of_skills_happens_and_no_other(mutated, name: str) -> None:
    scores, lengths, weights = changes(mutated[name][0])
    happened = scores.any((1, 2, 3))
    # At the ends a phase has no neighbour on one side.
    assert happened.mean() == pytest.approx(0.8 if name == "copy" else 1.0, abs=0.06)
    assert lengths.any() == (name == "shift")
    assert not weights.any()
    half = changes(mutated[name + " at half"][0])[0].any((1, 2, 3))
    assert half.mean() == pytest.approx(happened.mean() / 2, abs=0.08)
    # It is that operator.
    runs = (np.diff(scores.any((1, 3)).astype(int), axis=1, prepend=0) == 1).sum(1)
    counts = scores.any((1, 3)).sum(1)
    if name in ("skill", "copy"):
        assert counts.max() == (2 if name == "skill" else 1)
    if name == "skill":
        assert runs.max() == 2, "two phases anywhere"
    if name == "block":
        assert (runs == 1).all()
        assert counts.max() == PHASES
    if name == "shift":
        moved = parts_of(mutated[name][0])[0]
        old = parts_of(GENOMES)[0]
        inner = [np.roll(old, by, axis=2)[:, :, 2:-2] for by in (-2, -1, 1, 2)]
        assert np.any([(moved[:, :, 2:-2] == one).all((1, 2, 3)) for one in inner], axis=0).all()


@pytest.mark.parametrize("name", ["length", "stretch"])
def test_a_certain_change_of_lengths_happens_and_no_other(mutated, name: str) -> None:
    scores, lengths, weights = changes(mutated[name][0])
    assert lengths.any((1, 2)).mean() > 0.8
    assert not scores.any()
    assert not weights.any()
    assert set(lengths.any(1).sum(1)) == {0, 2 if name == "length" else 1}
    half = changes(mutated[name + " at half"][0])[1].any((1, 2))
    assert half.mean() == pytest.approx(lengths.any((1, 2)).mean() / 2, abs=0.08)
    by = (parts_of(mutated[name][0])[1] - parts_of(GENOMES)[1])[lengths]
    assert 0.2 < by.std() < 0.45, "the deviation is that of the configuration"


def test_a_certain_change_of_networks_happens_and_no_other(mutated) -> None:
    scores, lengths, weights = changes(mutated["network"][0])
    assert not scores.any()
    assert not lengths.any()
    assert (weights == weights[:, :1]).all(), "it is the same change of all whom it changes"
    weights = weights[:, 0]
    # Of 6 weights each with a share that is uniform in its logarithm between 1/6 and 0.4.
    shares = np.linspace(np.log(1 / WEIGHTS), np.log(0.4), 1001)
    assert weights.mean() == pytest.approx(np.exp(shares).mean(), abs=0.03)
    nothing = (1 - np.exp(shares)) ** WEIGHTS
    assert (~weights.any(1)).mean() == pytest.approx(nothing.mean(), abs=0.06)
    half = changes(mutated["network at half"][0])[2].any((1, 2))
    assert half.mean() == pytest.approx(weights.any(1).mean() / 2, abs=0.08)
    new, old = parts_of(mutated["network"][0])[2], parts_of(GENOMES)[2]
    noise = new - old
    np.testing.assert_allclose(noise[:, 0], noise[:, 2], atol=1e-6)
    assert noise[:, 0][weights].std() == pytest.approx(NONE.network_deviation, rel=0.1)


def test_certain_rules_are_a_few_weights_with_other_values_or_none_and_nothing_else(mutated) -> None:
    scores, lengths, weights = changes(mutated["rule"][0])
    assert not scores.any()
    assert not lengths.any()
    which = weights.any(1)
    shares = np.linspace(np.log(1 / WEIGHTS), np.log(0.4), 1001)
    assert which.mean() == pytest.approx(np.exp(shares).mean(), abs=0.03)
    assert (which.mean(0) > 0.1).all(), "any of them"
    new = parts_of(mutated["rule"][0])[2]
    values = new.transpose(0, 2, 1)[which]
    assert (values == values[:, :1]).all(), "they are the same rules for all"
    taken = np.array(
        [(row[who] == 0).all() for row, who in zip(parts_of(mutated["rule"][0])[2][:, 0], which, strict=True)]
    )
    assert taken[which.any(1)].mean() == pytest.approx(TAKEN_AWAY, abs=0.06)
    given = values[values[:, 0] != 0, 0]
    # Whatever a weight was before.
    assert given.mean() == pytest.approx(0, abs=0.4)
    assert given.std() == pytest.approx(NONE.rule_deviation, rel=0.12)
    half = changes(mutated["rule at half"][0])[2].any((1, 2))
    assert half.mean() == pytest.approx(which.any(1).mean() / 2, abs=0.08)


def test_where_nobody_is_better_no_rules_are_given() -> None:
    certain = dataclasses.replace(NONE, rule=1.0, together=1.0, group=0.0, **SHARES)
    both = dataclasses.replace(certain, network=1.0, skill=1.0)
    after = mutate_by({"rule": certain, "both": both}, GENOMES, AGENTS, judged=False)
    np.testing.assert_array_equal(after["rule"][0], GENOMES)
    scores, _, weights = changes(after["both"][0])
    assert scores.any((1, 2, 3)).all(), "timetables change all the same"
    deltas = (parts_of(after["both"][0])[2] - parts_of(GENOMES)[2])[weights]
    assert deltas.std() == pytest.approx(NONE.network_deviation, rel=0.1)


def test_one_change_has_nothing_to_do_with_another(mutated) -> None:
    scores, lengths, _ = changes(mutated["skill and length"][0])
    skill, length = scores.any((1, 2, 3)), lengths.any((1, 2))
    assert (skill & length).mean() == pytest.approx(skill.mean() * length.mean(), abs=0.06)


def test_the_share_of_weights_that_changes_is_the_one_that_is_given(mutated) -> None:
    never, rarely, often = (
        changes(mutated[f"share {share}"][0])[2][:, 0].mean() for share in (0.0, 0.02, 1.0)
    )
    assert never == 0
    assert rarely == pytest.approx(1 / WEIGHTS, abs=0.03), "0.02 of six weights would be none: so it is one"
    assert 0.35 < often < 0.55


def test_agents_take_over_a_teammates_timetable_and_network(mutated) -> None:
    old = np.asarray(GENOMES).reshape(CASES, AGENTS, ROW)
    after = mutated["teammate"][0].reshape(CASES, AGENTS, ROW)
    assert (after == after[:, :1]).all(), "all have the same"
    of_last = (after[:, 0] == old[:, 2]).all(1)
    assert (of_last | (after[:, 0] == old[:, 0]).all(1)).all()
    assert of_last.mean() == pytest.approx(1 / AGENTS, abs=0.07)
    half = mutated["teammate at half"][1]
    assert half.mean() == pytest.approx(0.5, abs=0.08)
    # A part of the team may, and the others stay as they are.
    after = mutated["teammate, part"][0].reshape(CASES, AGENTS, ROW)
    of_one = [(after == old[:, mate : mate + 1]).all(2) for mate in range(AGENTS)]
    assert np.any(of_one, axis=0).all()
    stayed = (after == old).all(2)
    assert stayed.any() and not stayed.all()
    assert ((~stayed).sum(1) == 1).any()
    # A whole group may, so that it stays one.
    after = mutated["teammate, group"][0].reshape(CASES, AGENTS, ROW)
    assert (after[:, 0] == after[:, 1]).all()
    assert (after[:, 2] != old[:, 2]).any()
    assert (after[:, 0] != old[:, 0]).any()


def who_changed(genomes: Any, part: int = 0) -> np.ndarray:
    """[cases, agents]"""
    changed = changes(genomes)[part]
    return changed.reshape(CASES, AGENTS, -1).any(2)


@pytest.mark.parametrize("part", [0, 2])
def test_a_change_of_a_group_is_of_all_who_follow_the_same(mutated, part: int) -> None:
    who = who_changed(mutated["group"][0], part)
    assert (who[:, 0] == who[:, 1]).all()
    happened = who.any(1)
    if part == 0:
        assert happened.all()
    assert not who.all(1).any()
    # An agent is drawn, and so a group by its size.
    assert who[happened, 0].mean() == pytest.approx(KIN / AGENTS, abs=0.1)


@pytest.mark.parametrize("part", [0, 2])
def test_a_change_of_a_part_is_of_anybody_and_of_somebody(mutated, part: int) -> None:
    who = who_changed(mutated["part"][0], part)
    happened = who.any(1)
    if part == 0:
        assert happened.all()
    who = who[happened]
    assert (who[:, 0] != who[:, 1]).any(), "kin may part"
    # With a share that is drawn too, any number is as likely as another; nobody counts as one.
    expected = np.array([2, 1, 1]) / (AGENTS + 1)
    np.testing.assert_allclose(np.bincount(who.sum(1), minlength=4)[1:] / len(who), expected, atol=0.07)
    np.testing.assert_allclose(who.mean(0), who.mean(), atol=0.08)


def test_scopes_have_their_shares(mutated) -> None:
    who = who_changed(mutated["mixed"][0])
    assert who.any(1).all()
    lone = (who.sum(1) == 1) & who[:, :2].any(1)
    everybody = who.all(1)
    # One of the kin alone: a part's. Of parts, with a share u of others: (1 - u)² and a third more.
    of_part = who_changed(mutated["part"][0])
    parts = ((of_part.sum(1) == 1) & of_part[:, :2].any(1)).mean()
    assert lone.mean() == pytest.approx(0.2 * parts, abs=0.05)
    assert everybody.mean() == pytest.approx(0.5 + 0.2 * of_part.all(1).mean(), abs=0.07)
    only_last = (who == np.array([False, False, True])).all(1)
    of_part_last = (of_part == np.array([False, False, True])).all(1).mean()
    assert only_last.mean() == pytest.approx(0.3 / AGENTS + 0.2 * of_part_last, abs=0.06)


def test_one_timetable_for_all_agents_changes_with_every_scope() -> None:
    for together, group in ((1.0, 0.0), (0.0, 1.0), (0.0, 0.0)):
        config = dataclasses.replace(NONE, together=together, group=group)
        one = PhaseVariation(config, 1, PHASES, SKILLS)
        assert one._who(jax.random.key(6), 1.0, jnp.ones((1, 1), bool)).tolist() == [True]


# Refusals


CONFIG = unhooked(module).PhaseMutationConfig


@pytest.mark.parametrize("value", [-0.25, 1.5, float("nan")])
@pytest.mark.parametrize("field", [*CHANCES, "together", "group", *SHARES])
def test_a_probability_is_between_0_and_1(field: str, value: float) -> None:
    expected = f"phases.{field} = {value}: give a probability between 0 and 1"
    assert refusal(CONFIG, **{field: value}) == expected


@pytest.mark.parametrize("value", [-0.5, float("inf"), float("nan")])
@pytest.mark.parametrize("field", ["deviation", "network_deviation", "rule_deviation"])
def test_a_deviation_is_at_least_0(field: str, value: float) -> None:
    assert refusal(CONFIG, **{field: value}) == f"phases.{field} = {value}: give a number of at least 0"


def test_scopes_are_shares_of_a_whole() -> None:
    assert refusal(CONFIG, together=0.75, group=0.5) == (
        "phases.together = 0.75 and phases.group = 0.5: their sum is above 1; lower one of them"
    )
    CONFIG(together=0.75, group=0.25)
