"""The soak's measure: what has filled up is flat, what goes on growing is not."""

import dataclasses
import itertools
import random
from pathlib import Path

import pytest
from benchmarks.harness.soak import STEPS, Held, commands, growth, is_flat

HOUR = 112
"""Commands."""
STANDING = Held(memory=740.0, files=9, threads=23, processes=0)


def hour(leaks: float = 0.0, **last: int) -> list[Held]:
    """What is held while caches fill within half of the commands and, beside them, something leaks."""
    filled = [min(number / (HOUR / 2), 1.0) for number in range(HOUR)]
    held = [
        dataclasses.replace(STANDING, memory=500 + 240 * share + leaks * number)
        for number, share in enumerate(filled)
    ]
    return held[: -HOUR // 4] + [dataclasses.replace(one, **last) for one in held[-HOUR // 4 :]]


def test_caches_that_fill_up_are_no_growth() -> None:
    grown = growth(hour())
    assert grown["memory"] == (740, 740) and is_flat(grown)


@pytest.mark.parametrize("leaks, flat", [(0.5, True), (1.0, False)])
def test_a_leak_of_a_mebibyte_for_each_command_is_found(leaks: float, flat: bool) -> None:
    assert is_flat(growth(hour(leaks))) is flat


@pytest.mark.parametrize("last", [{"files": 10}, {"threads": 24}, {"processes": 1}])
def test_one_more_of_what_may_not_grow_at_all_is_found(last: dict[str, int]) -> None:
    assert not is_flat(growth(hour(**last)))


def test_a_single_command_is_flat() -> None:
    assert is_flat(growth([STANDING]))


def test_the_last_commands_are_as_much_work_as_the_first() -> None:
    lived: dict[str, int] = {}
    for words in itertools.islice(commands(Path("/nowhere"), random.Random(3)), 400):
        if words[0] == "train":
            lived[words[words.index("--out") + 1]] = STEPS
        elif words[0] == "resume":
            steps = int(words[words.index("--steps") + 1])
            assert steps == lived[words[1]] + STEPS // 4
            lived[words[1]] = steps
    assert STEPS < max(lived.values()) < 5 * STEPS
