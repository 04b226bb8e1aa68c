import sys
from pathlib import Path

import numpy as np
import pytest

import experiment.trackers.memory as in_memory
from skillcrew.experiment.metrics import MetricsLog
from skillcrew.experiment.trackers import names

SEEDS = (3, 11)
CONFIGURATION = "algorithm:\n  name: ea\n  hidden: [8, 8]\nrun:\n  seeds: [3, 11]\n  out: null\n"


@pytest.fixture
def memory(monkeypatch):
    """A tracker of the name of any package that is installed."""
    monkeypatch.setitem(names.TRACKERS, "json", "experiment.trackers.memory:Memory")
    in_memory.Memory.forget()
    return in_memory.Memory


@pytest.fixture
def stub(monkeypatch):
    """What stands in the place of Weights & Biases, whether that is installed or not."""
    for name in ("wandb", "skillcrew.experiment.trackers.wandb"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    monkeypatch.syspath_prepend(Path(__file__).parent / "stub")
    import wandb

    yield wandb
    for name in ("wandb", "skillcrew.experiment.trackers.wandb"):
        sys.modules.pop(name, None)


@pytest.fixture
def grown():
    """A log with so many generations; of each, 100 environment steps, and 1 more for the second seed."""

    def make(generations):
        log = MetricsLog(SEEDS)
        generation = np.tile(np.arange(1, generations + 1), (2, 1))
        log.add(
            {
                "generation": generation,
                "environment_steps": generation * np.array([[100], [101]]),
                "success_rate": generation / 100,
                "loss_A": np.where(generation < 2, np.nan, generation * 0.5),
            }
        )
        return log

    return make
