"""Records at Weights & Biases: a run for each seed, all in one group."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import wandb

from skillcrew.errors import UserError
from skillcrew.experiment.metrics import Columns
from skillcrew.experiment.trackers.tracker import Tracked, finite

PROJECT = "skillcrew"
"""Where `WANDB_PROJECT` names no other one."""

UPLOAD_SECONDS = 300.0
"""Most time to wait for uploads in the end; `wandb sync` sends the rest."""


class WandB:
    """Keeps a run for each seed; files in `RUN/wandb`, whatever `WANDB_MODE` is. See `Tracker`."""

    def __init__(self, tracked: Tracked):
        self._runs = {seed: _begin(tracked, seed) for seed in tracked.seeds}

    @staticmethod
    def check() -> None:
        """Asks no questions: nobody may be there to answer."""
        if wandb.setup().settings.mode in ("online", "run") and not wandb.login(prompt=False, verify=False):
            raise UserError(
                "trackers: wandb is not logged in; `wandb login`, or set WANDB_MODE=offline and send the "
                "record later, by `wandb sync`"
            )

    def record(self, seed: int, columns: Columns) -> None:
        """W&B counts generations as its steps, which only rise: what comes twice is dropped."""
        for row, generation in enumerate(columns["generation"].tolist()):
            self._runs[seed].log(finite(columns, row), step=generation)

    def conclude(
        self, seed: int, steps: int, scores: Mapping[str, float], figures: Mapping[str, Path]
    ) -> None:
        """Scores into the run's summary, figures as images."""
        run = self._runs[seed]
        images = {name: wandb.Image(str(path)) for name, path in figures.items()}
        run.log({**images, "environment_steps": steps})
        run.summary.update(dict(scores))

    def flush(self) -> None:
        """W&B does so by itself."""

    def close(self) -> None:
        """Waits for what is still to be uploaded."""
        for run in self._runs.values():
            run.finish()


def _begin(tracked: Tracked, seed: int) -> Any:
    settings = wandb.Settings(
        # The terminal is the run's own; and what the machine does is no property of one seed of several.
        silent=True,
        console="off",
        x_disable_stats=True,
        finish_timeout=UPLOAD_SECONDS,
    )
    run = wandb.init(
        project=os.environ.get("WANDB_PROJECT", PROJECT),
        group=f"{tracked.run}-{tracked.identity}",
        name=f"{tracked.run}-seed-{seed}",
        id=f"{tracked.identity}-{seed}",
        resume="allow",
        config={"seed": seed, **tracked.configuration},
        allow_val_change=True,
        dir=str(tracked.place.parent),
        reinit="create_new",
        settings=settings,
    )
    run.define_metric("*", step_metric="environment_steps")
    return run
