"""Steps of many random worlds of the warehouse, beside the oracle's."""

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from oracles import warehouse, warehouse_cases
from oracles.carrying import Decisions
from oracles.comparing import steps_compared
from oracles.warehouse_cases import CASES, environment


@pytest.mark.parametrize("case", CASES)
@settings(max_examples=4, phases=(Phase.explicit, Phase.reuse, Phase.generate))
@given(seed=st.integers(0, 2**32 - 1))
def test_steps_are_those_of_the_oracle(case: str, seed: int) -> None:
    shares, _ = steps_compared(warehouse, warehouse_cases, case, seed)
    assert min(shares) > 0.8


@pytest.mark.parametrize("case", CASES)
def test_in_the_random_worlds_much_happens(case: str) -> None:
    happened = [
        one for seed in (1, 2, 3) for one in steps_compared(warehouse, warehouse_cases, case, seed)[1]
    ]
    config = environment(case).config

    def share(what) -> float:
        return float(np.mean([what(*one) for one in happened]))

    def inside(state) -> np.ndarray:
        return np.array([warehouse.in_corridor(config, Decisions(), place) for place in state.position])

    def stopped(_before, after, _outcome) -> bool:
        return (np.abs(np.abs(after.position[:, 0]) - config.corridor_length / 2) < 1e-5).any()

    def dropped(before, after, _outcome) -> bool:
        return (before.held.any(1) & ~after.held.any(1) & ~after.delivered).any()

    assert share(lambda before, after, _: (after.held & ~before.held).any()) > 0.01, "lifted"
    assert share(lambda before, after, _: (before.held.any(1) & after.held.any(1)).any()) > 0.05, "carried"
    assert share(dropped) > (0.01 if config.coupling > 1 else -1)
    assert share(lambda before, after, _: (~inside(before) & inside(after)).any()) > 0.01, "entered"
    assert share(lambda before, after, _: (inside(before) & ~inside(after)).any()) > 0.01, "left"
    assert share(stopped) > 0.03
    assert share(lambda _b, _a, outcome: outcome.team_reward) > 0.01
    assert share(lambda _b, _a, outcome: outcome.truncated) > 0.05
    assert share(lambda _b, _a, outcome: (outcome.observation[:, -1] > 0).any()) > 0.05, "occupied"
