import pytest

from experiment import tiny
from skillcrew.algorithms import registry
from skillcrew.experiment import generation
from skillcrew.experiment.config import to_yaml


@pytest.fixture
def counting(monkeypatch):
    """The counting algorithm, known by name as those of skillcrew are."""
    monkeypatch.setitem(registry.ALGORITHMS, "counting", registry.Listed("experiment.tiny:Counting", ""))
    return tiny.Counting(tiny.Countdown())


@pytest.fixture
def one_program(monkeypatch):
    """Runs of one configuration share what they compiled first, as if JAX had kept it.

    That another process makes the same program is shown where runs are killed.
    """
    programs = {}

    def shared(algorithm, config, runs, compiled=generation.CompiledChunk):
        same = to_yaml(algorithm, config)
        if same not in programs:
            programs[same] = compiled(algorithm, config, runs)
        return programs[same]

    monkeypatch.setattr(generation, "CompiledChunk", shared)
