"""Options of evolution that cannot be meant are refused in one line."""

from typing import Any

import pytest

from oracles.refusals import refusal, unhooked
from skillcrew.errors import UserError
from skillcrew.evolution import genetic, mutation, strategy

EvolutionConfig = unhooked(genetic).EvolutionConfig
MutationConfig = unhooked(mutation).MutationConfig
StrategyConfig = unhooked(strategy).StrategyConfig


@pytest.mark.parametrize(
    ("config", "field", "value"),
    [
        (EvolutionConfig, "elites", 0),
        (EvolutionConfig, "challengers", -1),
        (EvolutionConfig, "selection", "roulette"),
        (EvolutionConfig, "tournament_size", 0),
        (EvolutionConfig, "crossover_share", 1.5),
        (EvolutionConfig, "lineage_inheritance", -0.25),
        (EvolutionConfig, "lineage_memory", 0.5),
        (EvolutionConfig, "lineage_prior", -0.5),
        (EvolutionConfig, "champion_prior", -1.0),
        (EvolutionConfig, "level_memory", 0.5),
        (EvolutionConfig, "veterans", -1),
        (EvolutionConfig, "veterans", 5),
        (MutationConfig, "smallest_fraction", 0.9),
        (MutationConfig, "kind", "cosmic"),
        (MutationConfig, "probability", 1.25),
        (MutationConfig, "fraction", -0.5),
        (MutationConfig, "large_probability", 2),
        (MutationConfig, "reset_probability", -1),
        (MutationConfig, "strength", -0.125),
        (MutationConfig, "large_strength", -3.0),
        (MutationConfig, "reset_deviation", -2.0),
        (MutationConfig, "gaussian_deviation", -7.0),
        (MutationConfig, "limit", 0.0),
        (MutationConfig, "limit", float("nan")),
        (StrategyConfig, "deviation", 0.0),
        (StrategyConfig, "learning_rate", -0.5),
        (StrategyConfig, "learning_rate", float("nan")),
        (StrategyConfig, "fitness_memory", 0.75),
        (StrategyConfig, "patience", -1),
        (StrategyConfig, "tolerance", -0.1),
    ],
)
def test_refuses_a_value_and_names_field_and_value(config: Any, field: str, value: Any) -> None:
    message = refusal(config, **{field: value})
    assert field in message
    assert str(value) in message


def test_unknown_choices_come_with_the_valid_ones() -> None:
    assert "nearest first: tournament, proportional" in refusal(EvolutionConfig, selection="tournement")
    assert "nearest first: gaussian, substructured" in refusal(MutationConfig, kind="gauss")


def test_refuses_large_and_reset_shares_above_one_together() -> None:
    message = refusal(MutationConfig, large_probability=0.7, reset_probability=0.4)
    assert "large_probability = 0.7" in message
    assert "reset_probability = 0.4" in message


def test_population_must_leave_room_for_two_children() -> None:
    config = genetic.EvolutionConfig(elites=4)
    config.check_population(6)
    with pytest.raises(UserError, match=r"population = 5: .*elites \+ 2 = 6"):
        config.check_population(5)


def test_population_must_leave_room_for_two_children_beside_challengers() -> None:
    config = genetic.EvolutionConfig(elites=4, challengers=3)
    config.check_population(9)
    message = refusal(config.check_population, population=8)
    assert message == (
        "population = 8: smaller than evolution.elites + evolution.challengers + 2 = 9; "
        "raise population or lower evolution.elites or evolution.challengers"
    )
    message = refusal(genetic.EvolutionConfig(elites=4).check_population, population=5)
    assert message == (
        "population = 5: smaller than evolution.elites + 2 = 6; raise population or lower evolution.elites"
    )


def test_a_strategy_needs_mirrored_pairs() -> None:
    config = strategy.StrategyConfig()
    config.check_population(2)
    config.check_population(24)
    for population in (0, 1, 7):
        with pytest.raises(UserError, match=rf"population = {population}: .*mirrored pairs; give an even"):
            config.check_population(population)
