"""Checkpoints that hold everything a run goes on from, written whole or not at all (Orbax)."""

import contextlib
import json
import logging
import math
import shutil
import sys
from collections.abc import Generator
from pathlib import Path
from typing import Any

import jax
import numpy as np
import orbax.checkpoint as ocp
from jaxtyping import PyTree

from skillcrew.errors import UserError
from skillcrew.experiment.files import check_room, disk_errors, read_plain
from skillcrew.experiment.generation import flat_arrays
from skillcrew.experiment.integrity import DIGESTS, damage, seal

FORMAT = 4
"""Version of the layout, and of what states are made of; a checkpoint of another one is refused."""

BEFORE_DIGESTS = 3
"""The last version that had none, and another layout."""

ABOUT = "about.json"
UNFINISHED = ".unfinished-"

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
        names = [path.name for path in self.folder.iterdir()]
        # Not 007, which nobody here has written.
        return sorted(int(name) for name in names if name.isdecimal() and name == str(int(name)))

    def save(self, generation: int, state: PyTree, score: float, save_buffer: bool = True) -> None:
        """Writes a checkpoint; an interruption at any instant leaves the earlier ones untouched.

        Args:
            score: by which the best one is kept.

        Raises:
            UserError: the disk is full or cannot be written.
        """
        self.check_room(state, save_buffer)
        arrays = {name: np.asarray(leaf) for name, leaf in _saved(state, save_buffer).items()}
        about = {"format": FORMAT, "generation": generation, "buffer": save_buffer, "score": score}
        place, filling = self.folder / str(generation), self.folder / f"{UNFINISHED}{generation}"
        with disk_errors(self.folder):
            self._clear()
            filling.mkdir(parents=True)
            with _failing_quietly(), _storage() as storage:
                storage.save(filling.absolute() / "state", args=ocp.args.StandardSave(arrays))
            (filling / ABOUT).write_text(json.dumps(about) + "\n")
            seal(filling)
            filling.rename(place)
            self._discard_surplus()

    def check_room(self, state: PyTree, save_buffer: bool) -> None:
        """Raises `UserError` if the disk has no room for a checkpoint of this state."""
        check_room(self.folder.parent, sum(leaf.nbytes for leaf in _saved(state, save_buffer).values()))

    def choose(self, generation: int | None = None) -> tuple[int, list[str]]:
        """The checkpoint to go on from: by default the latest that is whole.

        Returns:
            Its generation, and a line for each later one that is damaged.

        Raises:
            UserError: there is none, the one that was asked for is damaged, or of another version.
        """
        found = self.generations()
        if not found:
            raise UserError(
                f"{self.folder}: holds no finished checkpoint; wait for the first one, or, if nothing trains "
                f"there, `skillcrew resume {self.folder.parent}`"
            )
        if generation is not None and generation not in found:
            raise UserError(
                f"{self.folder}: no checkpoint {generation}; there are {', '.join(map(str, found))}"
            )
        damaged: list[str] = []
        for candidate in [generation] if generation is not None else reversed(found):
            wrong = self._wrong_with(candidate)
            if wrong is None:
                return candidate, damaged
            damaged.append(f"{self.folder / str(candidate)}: {wrong}")
        if generation is None:
            raise UserError(f"{damaged[0]}, and there is no other to go on from; train into a new folder")
        others = " or ".join(str(other) for other in found if other != generation)
        mend = f"use another: --checkpoint {others}" if others else "there is no other to go on from"
        raise UserError(f"{damaged[0]}; {mend}")

    def read(self, like: PyTree, generation: int | None = None) -> tuple[dict[str, Any], bool]:
        """Reads a checkpoint, by default the latest that is whole, as named arrays (see `flat_arrays`).

        Args:
            like: shapes of the state that the run's configuration makes.

        Returns:
            The arrays, and whether those of the buffer are among them.

        Raises:
            UserError: as `choose`, or it is of another configuration.
        """
        place = self.folder.absolute() / str(self.choose(generation)[0])
        has_buffer = _about(place)["buffer"]
        expected = jax.eval_shape(flat_arrays, like)
        if not has_buffer:
            expected = {name: leaf for name, leaf in expected.items() if BUFFER not in name}
        with _storage() as storage:
            _check_same(expected, storage.metadata(place / "state").item_metadata.tree, place)
            hosted = {name: np.empty(leaf.shape, leaf.dtype) for name, leaf in expected.items()}
            return storage.restore(place / "state", args=ocp.args.StandardRestore(hosted)), has_buffer

    def discard_after(self, generation: int) -> None:
        """Deletes the checkpoints after one that a run goes on from, for the run to write anew."""
        for later in self.generations():
            if later > generation:
                _delete(self.folder / str(later))

    def _wrong_with(self, generation: int) -> str | None:
        """Why a checkpoint cannot be gone on from; None if it can.

        Raises:
            UserError: it is of another version.
        """
        place = self.folder / str(generation)
        about, wrong = _about(place), damage(place)
        if not (place / DIGESTS).exists() and (place / "about" / "metadata").exists():
            _check_version(BEFORE_DIGESTS, place)
        if about is None:
            return wrong or "not a checkpoint of skillcrew"
        if wrong is None:
            _check_version(about["format"], place)
        return wrong

    def _discard_surplus(self) -> None:
        """Deletes all but the latest few and the best."""
        scores = {generation: _score(self.folder / str(generation)) for generation in self.generations()}
        best = max(scores, key=lambda generation: (scores[generation], generation))
        for generation in sorted(scores)[: -self._keep]:
            if generation != best:
                _delete(self.folder / str(generation))

    def _clear(self) -> None:
        """Deletes what was being written when an earlier run was killed."""
        for left in self.folder.glob(f"{UNFINISHED}*"):
            _delete(left)


def _delete(place: Path) -> None:
    """Deletes a checkpoint, or what stands in its place; of a link, never what it leads to."""
    if place.is_dir() and not place.is_symlink():
        shutil.rmtree(place)
    else:
        place.unlink()


def instead(damaged: str, generation: int) -> str:
    """The line that says which checkpoint stands in for a damaged one."""
    return f"{damaged}; checkpoint {generation} is used instead"


@contextlib.contextmanager
def _failing_quietly() -> Generator[None]:
    """While something is written, and from then on if that fails, one kind of callback fails without a word.

    Orbax ends its event loop with the first array that cannot be written. Those of the others, which
    TensorStore goes on writing, find it closed, each with a traceback on standard error, some of them later.
    """
    before = sys.unraisablehook

    def hook(unraisable: Any) -> None:
        if not (unraisable.exc_type is RuntimeError and "Event loop is closed" in str(unraisable.exc_value)):
            before(unraisable)

    sys.unraisablehook = hook
    yield
    sys.unraisablehook = before


def _storage() -> ocp.Checkpointer:
    # Orbax logs each step of its work to the root logger, and each error that it raises as well.
    logging.getLogger("absl").setLevel(logging.CRITICAL)
    return ocp.Checkpointer(ocp.StandardCheckpointHandler())


def _score(place: Path) -> float:
    """By which the best checkpoint is kept; of one that is damaged, none is lower."""
    score = (_about(place) or {}).get("score")
    return score if isinstance(score, float) and not math.isnan(score) else -math.inf


def _about(place: Path) -> Any:
    """What a checkpoint says of itself; None if that cannot be read."""
    try:
        about = json.loads(read_plain(place / ABOUT))
    except (OSError, ValueError, RecursionError):
        return None
    if not (isinstance(about, dict) and isinstance(about.get("format"), int)):
        return None
    # What other versions say, only they know.
    return about if about["format"] != FORMAT or isinstance(about.get("buffer"), bool) else None


def _check_version(version: int, place: Path) -> None:
    if version > FORMAT:
        raise UserError(
            f"{place}: written by a newer skillcrew (checkpoint format {version}, this one reads {FORMAT}); "
            "upgrade skillcrew"
        )
    if version < FORMAT:
        raise UserError(
            f"{place}: written by an older skillcrew (checkpoint format {version}, this one reads {FORMAT}); "
            "go on with the skillcrew that wrote it, or train anew: `skillcrew train --config` takes the "
            "run's config.yaml"
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
