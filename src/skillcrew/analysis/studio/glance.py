"""What is seen of a run at a glance: how far it is, what it reached so far, and whether it trains."""

import dataclasses
import json
import math
import os
from pathlib import Path
from typing import Any, Literal

from skillcrew.analysis.report import PAGE
from skillcrew.analysis.studio.about import About, read_about
from skillcrew.analysis.studio.remembered import Remembered, stamp
from skillcrew.analysis.studio.survey import MOST_RUNS, check_own
from skillcrew.errors import UserError, one_line
from skillcrew.experiment.checkpoints import Checkpoints
from skillcrew.experiment.files import read_plain
from skillcrew.experiment.folder import RunFolder
from skillcrew.experiment.integrity import DIGESTS, check_known
from skillcrew.experiment.metrics import Columns, read_scores
from skillcrew.experiment.overview import final_scores, progress
from skillcrew.experiment.ownership import LOCK, holder
from skillcrew.experiment.score import score_among
from skillcrew.intervals import Interval

State = Literal["training", "stopped", "done", "damaged"]

LARGEST_TEXT = 2**20
LARGEST_METRICS = 2**29
"""Bytes of a file that is looked at."""

TRIES = 3
"""At a folder that changes while it is read."""


@dataclasses.dataclass(frozen=True)
class Facts:
    """What the files of a run say, apart from whether it trains."""

    about: About | None = None
    steps: int = 0
    """Environment steps that all seeds have lived."""
    word: str = ""
    """What its score is called."""
    score: str = ""
    rate: float | None = None
    """Environment steps per second, of all seeds together."""
    page: Literal["written", "makeable"] | None = None
    changed: float = 0.0
    """When, in seconds since 1970."""
    trouble: str | None = None
    """What is damaged."""


class Glances:
    """Looks at runs again and again, and reads only what has changed.

    Args:
        root: out of which no link is followed.
    """

    def __init__(self, root: Path):
        self._root = root
        self._abouts, self._facts = Remembered(2 * MOST_RUNS), Remembered(2 * MOST_RUNS)
        self._unheld, self._paces = Remembered(2 * MOST_RUNS), Remembered(2 * MOST_RUNS)

    def is_quick(self, path: Path) -> bool:
        """Whether nothing of a run has to be read anew."""
        return self._facts.has(path, stamp(_files(RunFolder(path))))

    def look(self, path: Path) -> tuple[State, Facts]:
        """What there is to say of a run; whatever its files hold, it is said and not raised."""
        folder = RunFolder(path)
        for _ in range(TRIES):
            before = stamp(_files(folder))
            facts = self._facts.get(path, before, lambda: self._read(folder))
            # A file that is replaced between two looks at it seems damaged.
            if facts.trouble is None or stamp(_files(folder)) == before:
                break
        if facts.trouble is not None:
            return "damaged", facts
        if self._is_held(folder):
            return "training", facts
        assert facts.about is not None
        return "done" if facts.steps >= facts.about.config.steps else "stopped", facts

    def about(self, folder: RunFolder) -> About:
        """What the configuration says.

        Raises:
            UserError: it is damaged.
        """
        check_own(folder.config, self._root, LARGEST_TEXT)
        check_own(folder.path / DIGESTS, self._root, LARGEST_TEXT)
        check_known(folder.config, "restore it")
        return self._abouts.get(folder.path, stamp((folder.config,)), lambda: read_about(folder))

    def scores(self, folder: RunFolder) -> Columns | None:
        """What curves are drawn from; None before there is anything.

        Raises:
            UserError: it is damaged.
        """
        check_own(folder.metrics, self._root, LARGEST_METRICS)
        return read_scores(folder.metrics) if folder.metrics.exists() else None

    def _read(self, folder: RunFolder) -> Facts:
        try:
            return self._found(folder)
        except UserError as error:
            trouble = str(error)
        except Exception as error:
            # Bytes of anybody's make whatever reads them raise anything.
            trouble = f"{folder.path}: cannot be read ({type(error).__name__}: {error})"
        return Facts(trouble=one_line(trouble))

    def _found(self, folder: RunFolder) -> Facts:
        about, columns = self.about(folder), self.scores(folder)
        page = self._page(folder)
        if columns is None or not len(columns["seed"]):
            return Facts(about, page=page, changed=folder.config.stat().st_mtime)
        reached = progress(columns)
        score = score_among(columns)
        steps = min(seed["environment_steps"] for seed in reached)
        mean = sum(seed[score.key] for seed in reached) / len(reached)
        text = score.number(mean) if math.isfinite(mean) else "–"
        if steps >= about.config.steps:
            text = self._final(folder, score.key) or text
        lived = sum(seed["environment_steps"] for seed in reached)
        rate, changed = self._rate(folder, lived), folder.metrics.stat().st_mtime
        return Facts(about, min(steps, about.config.steps), score.word, text, rate, page, changed)

    def _page(self, folder: RunFolder) -> Literal["written", "makeable"] | None:
        if os.path.isfile(folder.report / PAGE):
            return "written"
        return "makeable" if Checkpoints(folder.checkpoints, keep=1).generations() else None

    def _final(self, folder: RunFolder, key: str) -> str | None:
        """The champions' scores on fresh episodes, where they are written."""
        try:
            check_own(folder.scores, self._root, LARGEST_TEXT)
            found = final_scores(folder.scores)
        except UserError:
            return None
        if found is None or key not in found:
            return None
        reached = found[key]
        ends = [math.nan if reached[end] is None else reached[end] for end in ("low", "high")]
        return score_among(found).range(Interval(reached["mean"], *ends))

    def _rate(self, folder: RunFolder, lived: int) -> float | None:
        """Of the session that runs, between the last two looks; of one that is over, as it wrote it down."""
        check_own(folder.timing, self._root, LARGEST_TEXT)
        entries = _entries(folder.timing)
        if entries and (noted := _number(entries[-1].get("steps_per_second"))) is not None:
            return noted
        now = folder.metrics.stat().st_mtime
        # A first session begins with nothing, once it has noted how long compiling took.
        fresh = (folder.timing.stat().st_mtime, 0) if len(entries) == 1 else None
        session = stamp((folder.timing,))
        before = self._paces.get(folder.path, session, lambda: fresh)
        self._paces.put(folder.path, session, (now, lived))
        if before is None or not (now > before[0] and lived > before[1]):
            return None
        return (lived - before[1]) / (now - before[0])

    def _is_held(self, folder: RunFolder) -> bool:
        lock = stamp((folder.path / LOCK,))
        # A lock whose owner was killed is tried once, not every second.
        if self._unheld.has(folder.path, lock):
            return False
        held = holder(folder.path) is not None
        if not held:
            self._unheld.put(folder.path, lock, True)
        return held


def _files(folder: RunFolder) -> tuple[Path, ...]:
    """All that is looked at, but the lock."""
    own = (folder.config, folder.metrics, folder.timing, folder.scores, folder.checkpoints)
    return (*own, folder.path / DIGESTS, folder.report / PAGE)


def _entries(timing: Path) -> list[dict[str, Any]]:
    try:
        entries = json.loads(read_plain(timing))
    except (OSError, ValueError, RecursionError):
        return []
    sound = isinstance(entries, list) and all(isinstance(entry, dict) for entry in entries)
    return entries if sound else []


def _number(value: Any) -> float | None:
    return float(value) if isinstance(value, int | float) and math.isfinite(value) else None
