"""Run folders that nobody trained."""

import dataclasses

import numpy as np
import yaml

from skillcrew.experiment.config import RunConfig
from skillcrew.experiment.integrity import write_known
from skillcrew.experiment.metrics import MetricsLog

SEEDS = (3, 11)
STEPS = 1000
EVIL = "<img src=x onerror=alert(1)>"


def write_run(path, share=None, environment="meadow", **fields):
    """A run that has lived a share of its budget; None: no generation is over yet."""
    path.mkdir(parents=True)
    sections = {
        "algorithm": {"name": "madys", "population": 7},
        "environment": {"name": environment, "class": "nobody_imports_this:Meadow"},
        "run": dataclasses.asdict(RunConfig(**{"seeds": SEEDS, "steps": STEPS, **fields})),
    }
    sections["run"]["seeds"] = list(sections["run"]["seeds"])
    write_known(path / "config.yaml", lambda file: file.write_text(yaml.safe_dump(sections)))
    if share is not None:
        grow(path, share)
    return path


def grow(path, share, generations=20, seeds=SEEDS, steps=STEPS):
    """Success climbs from 0 to 1 over the budget."""
    lived = np.arange(1, round(share * generations) + 1)
    log = MetricsLog(seeds)
    log.add(
        {
            "generation": np.tile(lived.astype(np.int32), (len(seeds), 1)),
            "environment_steps": np.tile((lived * steps // generations).astype(np.int32), (len(seeds), 1)),
            "success_rate": np.tile((lived / generations).astype(np.float32), (len(seeds), 1)),
            "team_return": np.tile(lived.astype(np.float32), (len(seeds), 1)),
            "loss": np.full((len(seeds), len(lived)), np.nan),
        }
    )
    log.write(path / "metrics.parquet")
