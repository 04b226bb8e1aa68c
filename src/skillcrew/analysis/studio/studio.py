"""What the studio knows: the runs below a folder, their curves and their pages."""

import threading
import time
from pathlib import Path
from typing import Any

from skillcrew.analysis.studio.glance import Facts, Glances, State
from skillcrew.analysis.studio.live_curves import LiveCurves
from skillcrew.analysis.studio.run_page import Pages, Shown
from skillcrew.analysis.studio.survey import find_runs
from skillcrew.errors import UserError, one_line

PATIENCE = 0.4
"""Seconds in which runs are read for one answer; the others are read for the next ones."""


class Studio:
    """A folder of runs, looked at by anybody who asks, one after the other.

    Args:
        root: the folder.
        scratch: an existing folder, for pages that are made.

    Raises:
        UserError: there is no such folder.
    """

    def __init__(self, root: Path, scratch: Path):
        if not root.is_dir():
            raise UserError(f"{root}: no such folder; give one that holds runs")
        self._root = root
        self._glances = Glances(root)
        self._curves = LiveCurves(self._glances)
        self._pages = Pages(root, scratch)
        self._lock = threading.Lock()

    def runs(self) -> dict[str, Any]:
        """All runs, those that train first and then those that changed last."""
        with self._lock:
            found, cut = find_runs(self._root)
            end = time.monotonic() + PATIENCE
            rows = [self._row(key, path, end) for key, path in found.items()]
        rows = [row for row in rows if row is not None]
        rows.sort(key=lambda row: (row["state"] != "training", -row["changed"], row["name"]))
        return {"root": one_line(str(self._root.absolute())), "runs": rows, "cut": cut}

    def prepare(self, seconds: float = 5.0) -> None:
        """Reads runs for so long, or until all are read."""
        end = time.monotonic() + seconds
        while time.monotonic() < end and any(row["state"] == "reading" for row in self.runs()["runs"]):
            pass

    def curves(self, keys: list[str]) -> dict[str, Any]:
        """Panels of the curves of some runs; keys of runs that have gone are passed over."""
        with self._lock:
            found, _ = find_runs(self._root)
            chosen = [(self._name(found[key]), found[key]) for key in dict.fromkeys(keys) if key in found]
            return self._curves.describe(chosen)

    def page(self, key: str) -> Shown:
        """The page of a run.

        Raises:
            UserError: the run has gone, or its page is damaged.
        """
        found, _ = find_runs(self._root)
        if key not in found:
            raise UserError("this run is not there any more")
        return self._pages.show(found[key])

    def close(self) -> None:
        """Ends what is under way."""
        self._pages.close()

    def _name(self, path: Path) -> str:
        name = path.relative_to(self._root) if path != self._root else path.absolute().name
        return one_line(str(name))

    def _row(self, key: str, path: Path, end: float) -> dict[str, Any] | None:
        """What the table says of a run; None if it has gone in the meantime."""
        if time.monotonic() > end and not self._glances.is_quick(path):
            return _as_row(key, self._name(path), "reading", Facts())
        state, facts = self._glances.look(path)
        if facts.trouble is not None and not (path / "config.yaml").exists():
            return None
        return _as_row(key, self._name(path), state, facts)


def _as_row(key: str, name: str, state: State | str, facts: Facts) -> dict[str, Any]:
    about = facts.about
    works = state in ("training", "done")
    return {
        "key": key,
        "name": name,
        "state": state,
        "trouble": facts.trouble,
        "algorithm": about and one_line(about.algorithm),
        "environment": about and one_line(about.environment),
        "seeds": about and len(about.config.seeds),
        "budget": about and about.config.steps,
        "steps": facts.steps,
        "word": facts.word,
        "score": facts.score,
        "rate": round(facts.rate) if works and facts.rate is not None else None,
        "page": facts.page,
        "changed": facts.changed,
    }
