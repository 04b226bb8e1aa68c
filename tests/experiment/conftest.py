import pytest

from experiment import tiny
from skillcrew.algorithms import registry


@pytest.fixture
def counting(monkeypatch):
    """The counting algorithm, known by name as those of skillcrew are."""
    monkeypatch.setitem(registry.ALGORITHMS, "counting", registry.Listed("experiment.tiny:Counting", ""))
    return tiny.Counting(tiny.Countdown())
