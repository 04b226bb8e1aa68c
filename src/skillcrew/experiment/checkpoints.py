"""Checkpoints that hold everything a run goes on from, written whole or not at all (Orbax)."""

import contextlib
import logging
import shutil
import sys
from collections.abc import Generator
from pathlib import Path
from typing import Any

import jax
import numpy as np
import orbax.checkpoint as ocp
from jaxtyping import PyTree
from orbax.checkpoint import checkpoint_managers as policies

from skillcrew.errors import UserError
from skillcrew.experiment.files import check_room, disk_errors
from skillcrew.experiment.generation import flat_arrays

FORMAT = 3
"""Version of the layout, and of what states are made of; a checkpoint of another one is refused."""

BUFFER = "experience"
"""A leaf with this in its path belongs to a replay buffer."""


class Checkpoints:
    """The checkpoints of one run, by generation: the latest `keep` and the best.

    Args:
        folder: made when the first checkpoint is saved.
        keep: how many of the latest to keep.
    """

    def __init__(self, folder: Path, keep: int = 2):
        self.folder = folder
        self._keep = keep

    def generations(self) -> list[int]:
        """Generations of which a finished checkpoint exists, oldest first."""
        if not self.folder.is_dir():
            return []
        return sorted(int(path.name) for path in self.folder.iterdir() if path.name.isdecimal())

    def save(self, generation: int, state: PyTree, score: float, save_buffer: bool = True) -> None:
        """Writes a checkpoint; an interruption at any instant leaves the earlier ones untouched.

        Args:
            score: by which the best one is kept.

        Raises:
            UserError: the disk is full or cannot be written.
        """
        self.check_room(state, save_buffer)
        arrays = {name: np.asarray(leaf) for name, leaf in _saved(state, save_buffer).items()}
        about = {"format": FORMAT, "generation": generation, "buffer": save_buffer}
        with disk_errors(self.folder), self._manager() as manager:
            manager.save(
                generation,
                args=ocp.args.Composite(state=ocp.args.StandardSave(arrays), about=ocp.args.JsonSave(about)),
                metrics={"score": score},
                force=True,
            )
            manager.wait_until_finished()

    def check_room(self, state: PyTree, save_buffer: bool) -> None:
        """Raises `UserError` if the disk has no room for a checkpoint of this state."""
        check_room(self.folder.parent, sum(leaf.nbytes for leaf in _saved(state, save_buffer).values()))

    def read(self, like: PyTree, generation: int | None = None) -> tuple[dict[str, Any], bool]:
        """Reads a checkpoint, by default the latest, as named arrays (see `flat_arrays`).

        Args:
            like: shapes of the state that the run's configuration makes.

        Returns:
            The arrays, and whether those of the buffer are among them.

        Raises:
            UserError: no checkpoint, damaged, of another configuration, or of a newer version.
        """
        generation = self._existing(generation)
        place = self.folder / str(generation)
        expected = jax.eval_shape(flat_arrays, like)
        with self._damage_as_user_error(place), self._manager() as manager:
            about = manager.restore(generation, args=ocp.args.Composite(about=ocp.args.JsonRestore()))[
                "about"
            ]
            _check_version(about, place)
            if not about["buffer"]:
                expected = {name: leaf for name, leaf in expected.items() if BUFFER not in name}
            _check_same(expected, manager.item_metadata(generation)["state"], place)
            hosted = {name: np.empty(leaf.shape, leaf.dtype) for name, leaf in expected.items()}
            restored = manager.restore(
                generation, args=ocp.args.Composite(state=ocp.args.StandardRestore(hosted))
            )
        return restored["state"], about["buffer"]

    def discard_after(self, generation: int) -> None:
        """Deletes the checkpoints after one that a run goes on from, for the run to write anew."""
        for later in self.generations():
            if later > generation:
                shutil.rmtree(self.folder / str(later))

    def _existing(self, generation: int | None) -> int:
        found = self.generations()
        if not found:
            raise UserError(f"{self.folder}: holds no finished checkpoint; train into a new folder")
        if generation is None:
            return found[-1]
        if generation not in found:
            raise UserError(
                f"{self.folder}: no checkpoint {generation}; there are {', '.join(map(str, found))}"
            )
        return generation

    @contextlib.contextmanager
    def _manager(self) -> Generator[ocp.CheckpointManager]:
        # Orbax logs each step of its work as warnings to the root logger.
        logging.getLogger("absl").setLevel(logging.ERROR)
        keep = [
            policies.LatestN(self._keep),
            policies.BestN(get_metric_fn=_score, n=1),
        ]
        options = ocp.CheckpointManagerOptions(
            # Orbax stores metrics only where it is told how to read them.
            best_fn=_score,
            preservation_policy=policies.AnyPreservationPolicy(keep),
            enable_async_checkpointing=False,
            cleanup_tmp_directories=True,
        )
        # Named handlers, so that a manager that saved nothing itself can read what is there.
        handlers = {"state": ocp.StandardCheckpointHandler(), "about": ocp.JsonCheckpointHandler()}
        with ocp.CheckpointManager(
            self.folder.absolute(), options=options, item_handlers=handlers
        ) as manager:
            yield manager

    @contextlib.contextmanager
    def _damage_as_user_error(self, place: Path) -> Generator[None]:
        try:
            yield
        except UserError:
            raise
        except Exception as error:
            _silence_unfinished_reads()
            others = [str(other) for other in self.generations() if str(other) != place.name]
            mend = (
                f"use another: --checkpoint {' or '.join(others)}"
                if others
                else "there is no other to go on from"
            )
            raise UserError(f"{place}: damaged or not a checkpoint of skillcrew; {mend}") from error


def _silence_unfinished_reads() -> None:
    """Keeps a failed restore to its one line.

    When one array cannot be read, Orbax closes its event loop while the reads of the others are
    under way; each of them then prints that the loop is closed, from a thread of its own.
    """
    shows_exception, shows_unraisable = sys.excepthook, sys.unraisablehook

    def is_echo(error: BaseException | None) -> bool:
        return isinstance(error, RuntimeError) and str(error) == "Event loop is closed"

    sys.excepthook = lambda kind, error, trace: (
        None if is_echo(error) else shows_exception(kind, error, trace)
    )
    sys.unraisablehook = lambda about: None if is_echo(about.exc_value) else shows_unraisable(about)


def _score(metrics: dict[str, float]) -> float:
    # Every score was called a success rate once.
    return metrics["score"] if "score" in metrics else metrics["success_rate"]


def _check_version(about: Any, place: Path) -> None:
    if not isinstance(about, dict) or not isinstance(about.get("format"), int):
        raise UserError(f"{place}: not a checkpoint of skillcrew")
    if about["format"] > FORMAT:
        raise UserError(
            f"{place}: written by a newer skillcrew (checkpoint format {about['format']}, this one "
            f"reads {FORMAT}); upgrade skillcrew"
        )
    if about["format"] < FORMAT:
        raise UserError(
            f"{place}: written by an older skillcrew (checkpoint format {about['format']}, this one reads "
            f"{FORMAT}); go on with the skillcrew that wrote it, or train anew: `skillcrew train --config` "
            "takes the run's config.yaml"
        )


def _check_same(expected: dict[str, Any], stored: Any, place: Path) -> None:
    """Refuses a checkpoint whose arrays are not those that the run folder's configuration makes."""
    found = {name: tuple(stored[name].shape) for name in stored}
    for name, leaf in expected.items():
        if found.get(name) != tuple(leaf.shape):
            raise UserError(
                f"{place}: belongs to another configuration ({name} is {found.get(name, 'missing')}, "
                f"config.yaml asks for {tuple(leaf.shape)}); restore the config.yaml it was made with"
            )


def _saved(state: PyTree, save_buffer: bool) -> dict[str, jax.Array]:
    """The arrays of a state that a checkpoint holds, by name."""
    arrays = flat_arrays(state)
    return {name: leaf for name, leaf in arrays.items() if save_buffer or BUFFER not in name}
