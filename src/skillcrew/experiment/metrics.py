"""One row per seed and generation, in one columnar file (Parquet)."""

from collections.abc import Collection, Mapping
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from skillcrew.errors import UserError
from skillcrew.experiment.integrity import check_known, write_known
from skillcrew.experiment.score import RETURN, SUCCESS

Columns = dict[str, np.ndarray]

MOVE_AWAY = "move it away, then `skillcrew resume` goes on without the earlier rows"

WHOLE = ("seed", "generation", "environment_steps")
"""Columns of whole numbers, which every file has."""

SCORED = (*WHOLE, SUCCESS.key, RETURN.key)
"""Columns that learning curves are drawn from."""

MOST_SCORED = 5_000_000
"""Rows that are read only to be looked at; a few bytes may stand for more than any memory holds."""


class MetricsLog:
    """Collects the metrics of all seeds.

    Seeds step together until the last has lived its budget, so the others have a few rows beyond
    theirs: filter by `environment_steps` where that matters.

    Args:
        seeds: of the run, in the order of the seed axis.
    """

    def __init__(self, seeds: tuple[int, ...]):
        self._seeds = seeds
        self._parts: list[Columns] = []

    def add(self, metrics: Mapping[str, np.ndarray]) -> None:
        """Takes in a chunk of metrics with axes [seeds, generations]."""
        n_seeds, generations = metrics["generation"].shape
        rows = {"seed": np.repeat(np.asarray(self._seeds, np.int64), generations)}
        rows |= {name: np.asarray(values).reshape(n_seeds * generations) for name, values in metrics.items()}
        self._parts.append(rows)

    def restore(self, columns: Columns, generation: int) -> None:
        """Starts from the rows of an earlier session, up to a generation."""
        keep = columns["generation"] <= generation
        self._parts = [{name: values[keep] for name, values in columns.items()}]

    def columns(self) -> Columns:
        """All rows, ordered by seed as the run lists them and then by generation."""
        # An earlier session may have measured more or less.
        shared = [name for name in self._parts[-1] if all(name in part for part in self._parts)]
        joined = {name: np.concatenate([part[name] for part in self._parts]) for name in shared}
        rank = {seed: index for index, seed in enumerate(self._seeds)}
        of_row = np.asarray([rank[int(seed)] for seed in joined["seed"]])
        order = np.lexsort((joined["generation"], of_row))
        return {name: values[order] for name, values in joined.items()}

    def after(self, generation: int) -> Columns:
        """The rows after a generation, in the same order; nothing at all where there are none."""
        columns = self.columns() if self._parts else {"generation": np.zeros(0, np.int64)}
        new = columns["generation"] > generation
        return {name: values[new] for name, values in columns.items()} if new.any() else {}

    def write(self, path: Path) -> None:
        """Replaces the file at once."""
        table = pa.table(self.columns())
        write_known(path, lambda temporary: pq.write_table(table, temporary))


def read_metrics(path: Path) -> Columns:
    """The columns of a metrics file, as arrays.

    Where a file has no column for the mean return, it is older than that, and called it the success rate.

    Raises:
        UserError: missing or damaged.
    """
    return _read(path, None)


def read_scores(path: Path) -> Columns:
    """Of the same, the columns that learning curves are drawn from.

    Raises:
        UserError: missing or damaged, or of more than `MOST_SCORED` rows.
    """
    return _read(path, SCORED)


def _read(path: Path, wanted: Collection[str] | None) -> Columns:
    """All columns, or the wanted ones of a file of bounded size."""
    check_known(path, MOVE_AWAY)
    try:
        if not path.is_file():
            raise FileNotFoundError
        # Not by its path: that may hold what is no text.
        with path.open("rb") as opened, pq.ParquetFile(opened) as file:
            if wanted is not None and (rows := file.metadata.num_rows) > MOST_SCORED:
                raise UserError(f"{path}: {rows} rows, and at most {MOST_SCORED} are looked at")
            fields = [field for field in file.schema_arrow if wanted is None or field.name in wanted]
            # Before it is read: a text may stand there once and be meant for each row.
            if texts := [field.name for field in fields if not pa.types.is_primitive(field.type)]:
                raise _no_numbers(path, texts[0])
            table = file.read([field.name for field in fields])
        columns = {name: table.column(name).to_numpy() for name in table.column_names}
    except (OSError, ValueError, KeyError, pa.ArrowException) as error:
        raise UserError(f"{path}: missing or damaged metrics; {MOVE_AWAY}") from error
    if not set(WHOLE) <= set(columns) or not ({SUCCESS.key, RETURN.key} & set(columns)):
        raise UserError(f"{path}: not metrics of skillcrew")
    for name, values in columns.items():
        if values.dtype.kind not in ("iu" if name in WHOLE else "iufb"):
            raise _no_numbers(path, name)
    return columns if RETURN.key in columns else {**columns, RETURN.key: columns[SUCCESS.key]}


def _no_numbers(path: Path, name: str) -> UserError:
    return UserError(f"{path}: not metrics of skillcrew ({name} holds other than numbers); {MOVE_AWAY}")
