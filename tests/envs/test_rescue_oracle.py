"""Steps of many random worlds of search and rescue, beside the oracle's."""

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from oracles import rescue, rescue_cases
from oracles.comparing import steps_compared
from oracles.rescue_cases import CASES, environment


@pytest.mark.parametrize("case", CASES)
@settings(max_examples=4, phases=(Phase.explicit, Phase.reuse, Phase.generate))
@given(seed=st.integers(0, 2**32 - 1))
def test_steps_are_those_of_the_oracle(case: str, seed: int) -> None:
    shares, _ = steps_compared(rescue, rescue_cases, case, seed)
    assert min(shares) > 0.8


@pytest.mark.parametrize("case", CASES)
def test_in_the_random_worlds_much_happens(case: str) -> None:
    _, happened = steps_compared(rescue, rescue_cases, case, 1)

    def dropped(before, after, _) -> bool:
        return (before.held.any(1) & ~after.held.any(1) & ~after.saved).any()

    def carried(before, after, _) -> bool:
        return (before.held.any(1) & (after.victim != before.victim).any(1)).any()

    def share(what) -> float:
        return float(np.mean([what(*one) for one in happened]))

    assert share(lambda before, after, _: (after.held & ~before.held).any()) > 0.03, "lifted"
    assert share(carried) > 0.1
    # A victim that one agent lifts is lifted again by any other that is near.
    assert share(dropped) > (0.01 if environment(case).config.coupling > 1 else -1)
    assert share(lambda _b, _a, outcome: outcome.team_reward) > 0.01
    assert share(lambda _b, _a, outcome: outcome.truncated) > 0.05
    assert share(lambda before, after, _: before.searched.sum() > after.searched.sum()) > 0.005, "begun anew"
    assert share(lambda _b, _a, outcome: (outcome.observation[:, 7] > 0).any()) > 0.05, "calls"
