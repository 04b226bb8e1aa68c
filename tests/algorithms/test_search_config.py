"""Options of the search that cannot be meant are refused in one line that says how to mend it."""

from typing import Any

import pytest

from oracles.refusals import refusal, unhooked
from skillcrew.algorithms import mfl, team_search
from skillcrew.evolution.evosax_bridge import EVOSAX_NAMES
from skillcrew.evolution.strategy import StrategyConfig

loaded = unhooked(team_search)


@pytest.mark.parametrize(
    ("config", "field", "value"),
    [
        ("SearchConfig", "population", 0),
        ("SearchConfig", "episodes", -2),
        ("SearchConfig", "fitness_discount", 0.0),
        ("SearchConfig", "fitness_discount", 1.25),
        ("RaceConfig", "finalists", -1),
        ("RaceConfig", "episodes", 0),
    ],
)
def test_refuses_a_value_and_names_field_and_value(config: str, field: str, value: Any) -> None:
    message = refusal(getattr(loaded, config), **{field: value})
    assert f"{field} = {value}" in message
    assert "give" in message


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        (
            {"evolver": "stratgey"},
            ["evolver 'stratgey'", "nearest first: strategy,", "coevolution", "sep_cma_es"],
        ),
        ({"population": 5}, ["population = 5", "elites + 2 = 6"]),
        ({"evolver": "strategy", "population": 9}, ["population = 9", "mirrored pairs"]),
        (
            {"evolver": "open_es", "population": 9},
            ["population = 9", "evolver = open_es samples mirrored pairs", "give an even number"],
        ),
        ({"evolver": "snes", "population": 3}, ["population = 3", "evolver = snes", "give at least 4"]),
        (
            {"evolver": "open_es", "episodes_shared_by": "pair"},
            ["episodes_shared_by = pair", "evolver = open_es", "set episodes_shared_by to population"],
        ),
        *(
            (
                {"race": team_search.RaceConfig(finalists=3), "evolver": evolver},
                ["race.finalists = 3", "set race.finalists to 0 or evolver to genetic"],
            )
            for evolver in EVOSAX_NAMES
        ),
        (
            {"evolver": "coevolution", "population": 5},
            ["population = 5", "a subpopulation has 5 individuals"],
        ),
        (
            {
                **{"evolver": "coevolution", "population": 7},
                "evolution": team_search.EvolutionConfig(elites=4, challengers=2),
            },
            ["population = 7", "7 individuals, fewer than evolution.elites + evolution.challengers + 2 = 8;"],
        ),
        (
            {"population": 7, "evolution": team_search.EvolutionConfig(elites=4, challengers=2)},
            ["population = 7: smaller than evolution.elites + evolution.challengers + 2 = 8;"],
        ),
        ({"episodes_shared_by": "team"}, ["episodes_shared_by 'team'", "pair, population"]),
        (
            {"episodes_shared_by": "pair"},
            ["episodes_shared_by = pair", "evolver = genetic has no pairs", "set episodes_shared_by to"],
        ),
        (
            {"race": team_search.RaceConfig(finalists=41)},
            ["race.finalists = 41", "population = 40", "lower it"],
        ),
        (
            {"race": team_search.RaceConfig(finalists=3), "evolver": "strategy"},
            ["race.finalists = 3", "set race.finalists to 0 or evolver to genetic"],
        ),
    ],
)
def test_what_does_not_go_together_is_refused(fields: dict[str, Any], expected: list[str]) -> None:
    message = refusal(loaded.SearchConfig, **fields)
    for part in expected:
        assert part in message


def test_a_population_need_suit_only_the_evolver_that_is_used() -> None:
    # Two are too few for four elites, and enough for one mirrored pair.
    team_search.SearchConfig(evolver="strategy", population=2, strategy=StrategyConfig())
    team_search.SearchConfig(evolver="genetic", population=7)
    team_search.SearchConfig(evolver="cma_es", population=5)


@pytest.mark.parametrize(
    ("field", "value"),
    [("pretraining_steps", 0), ("exploration_change", 0.0), ("exploration_change", 1.5)],
)
def test_mfl_refuses_a_value_and_names_field_and_value(field: str, value: Any) -> None:
    assert f"{field} = {value}: give" in refusal(mfl.MFLConfig, **{field: value})


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        ({"recorded_episodes": 0}, "recorded_episodes = 0: give at least 1"),
        ({"recorded_episodes": 6}, "recorded_episodes = 6: above episodes = 5; lower it"),
        ({"probe_episodes": 6}, "probe_episodes = 6: above episodes = 5"),
    ],
)
def test_no_more_episodes_are_recorded_or_probed_than_there_are(
    fields: dict[str, Any], expected: str
) -> None:
    assert expected in refusal(mfl.MFLConfig, **fields)
