"""The harnesses in short: a few damages, some inputs. `make harness` runs them at length."""

import pytest
from benchmarks.harness.damages import run_damages
from benchmarks.harness.inputs import run_inputs


@pytest.fixture
def room(tmp_path):
    place = tmp_path / "room"
    place.mkdir()
    return place


def test_damage_is_found_or_harmless(finished, room):
    summary, problems = run_damages(finished, room, 12, seed=1, in_turn=("evaluate", "report", "resume"))
    assert not problems, problems[0]
    assert summary == "12 damages: 12 found or harmless, 0 different, 0 tracebacks (seed 1)"


def test_no_input_ends_in_a_traceback(finished, room):
    summary, problems = run_inputs(finished, room, range(150), seed=1)
    assert not problems, problems[0]
    assert summary == "150 inputs: 0 tracebacks, 0 hangs, 0 other exit codes (seed 1)"
