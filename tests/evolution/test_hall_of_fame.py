"""The hall of fame keeps the best there ever were, and gives them back at the rates it promises."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from oracles.refusals import refusal, unhooked
from skillcrew.evolution import hall_of_fame
from skillcrew.evolution.hall_of_fame import HallOfFame, HallOfFameConfig

SIZE, AGENTS, GENES = 3, 2, 5

loaded = unhooked(hall_of_fame)


def filled(fitness) -> HallOfFame:
    hall = HallOfFame.create(SIZE, AGENTS, GENES)
    for value in fitness:
        hall = hall.enter(jnp.full((AGENTS, GENES), value), jnp.float32(value))
    return hall


def test_it_keeps_the_best_in_whatever_order_they_come() -> None:
    rng = np.random.default_rng(0)
    values = rng.permutation(8) / 8
    for known in range(1, len(values) + 1):
        hall = filled(values[:known])
        best = sorted(values[:known])[-SIZE:]
        kept = np.asarray(hall.fitness)[np.asarray(hall.taken)]
        assert sorted(kept) == best
        # Each with its own genomes.
        for genomes, fitness in zip(hall.genomes[np.asarray(hall.taken)], kept, strict=True):
            np.testing.assert_array_equal(genomes, np.full((AGENTS, GENES), fitness))


def test_a_catastrophic_generation_takes_no_place() -> None:
    before = filled([0.5, 0.75, 0.625])
    after = before.enter(jnp.full((AGENTS, GENES), -1.0), jnp.float32(0.0))
    jax.tree.map(np.testing.assert_array_equal, before, after)


def test_free_places_are_never_drawn() -> None:
    for fitness in ({0.0, 0.25}, {-3.0, -2.0}):
        hall = filled(sorted(fitness))
        for sampling in ("uniform", "proportional"):
            drawn = hall.draw(jax.random.key(0), (500,), HallOfFameConfig(SIZE, sampling=sampling))
            assert set(np.asarray(hall.fitness)[np.unique(drawn)]) <= fitness


@pytest.mark.parametrize(
    ("sampling", "fitness", "expected"),
    [
        ("uniform", [0.1, 0.2, 0.7], [1 / 3, 1 / 3, 1 / 3]),
        ("proportional", [0.1, 0.2, 0.7], [0.1, 0.2, 0.7]),
        ("proportional", [0.0, 0.0, 0.0], [1 / 3, 1 / 3, 1 / 3]),
        ("proportional", [-8.0, -6.0, 4.0], [0, 2 / 14, 12 / 14]),
        ("proportional", [-5.0, -5.0, -5.0], [1 / 3, 1 / 3, 1 / 3]),
    ],
)
def test_rates_of_drawing(sampling, fitness, expected) -> None:
    draws = 20_000
    hall = filled(fitness)
    drawn = hall.draw(jax.random.key(1), (draws // 4, 4), HallOfFameConfig(SIZE, sampling=sampling))
    assert drawn.shape == (draws // 4, 4)
    order = np.argsort(np.asarray(hall.fitness), kind="stable")
    rates = np.bincount(np.asarray(drawn).ravel(), minlength=SIZE)[order] / draws
    np.testing.assert_allclose(rates, expected, atol=4 * 0.5 / draws**0.5)


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        ({"size": -1}, "hall_of_fame.size = -1: give a number of teams, or 0"),
        ({"share": 0.0}, "hall_of_fame.share = 0.0: give a probability above 0 and below 1"),
        ({"share": 1.0}, "hall_of_fame.share = 1.0: give a probability above 0 and below 1"),
        ({"sampling": "unifrom"}, "hall_of_fame.sampling 'unifrom'; valid, nearest first: uniform"),
    ],
)
def test_refuses_a_value_and_names_field_and_value(fields, expected) -> None:
    assert expected in refusal(loaded.HallOfFameConfig, **fields)
