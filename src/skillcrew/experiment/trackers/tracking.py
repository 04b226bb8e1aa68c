"""The trackers of a run, told together; one that fails says so once, and the run goes on without it."""

import contextlib
import dataclasses
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from pathlib import Path

import yaml

from skillcrew.errors import UserError, one_line
from skillcrew.experiment.evaluation import Evaluation
from skillcrew.experiment.metrics import Columns, MetricsLog
from skillcrew.experiment.trackers.names import check_names
from skillcrew.experiment.trackers.reached import Reached
from skillcrew.experiment.trackers.tracker import Tracked, Tracker, tracker_class

WITHOUT = "The run goes on without this record; a later `skillcrew resume` fills the gap."

Figures = Mapping[int, Mapping[str, Path]]
"""Of each seed, those of the report, as PNG and by name."""


@dataclasses.dataclass
class Record:
    """One tracker at work, and how far it has come."""

    name: str
    folder: Path
    tracker: Tracker
    reached: Reached

    def take(self, log: MetricsLog) -> None:
        """Whatever the log has and the record has not."""
        columns = log.after(self.reached.generation)
        if not columns:
            return
        for seed, rows in _by_seed(columns):
            self.tracker.record(seed, rows)
        self.tracker.flush()
        self._reach(generation=int(columns["generation"].max()))

    def conclude(self, evaluation: Evaluation, columns: Callable[[], Columns], figures: Figures) -> None:
        """Once for the generation that it has come to."""
        if self.reached.concluded == self.reached.generation:
            return
        steps = {seed: int(rows["environment_steps"].max()) for seed, rows in _by_seed(columns())}
        for seed in evaluation.seeds:
            self.tracker.conclude(seed, steps[seed], _scores(evaluation, seed), figures[seed])
        self.tracker.flush()
        self._reach(concluded=self.reached.generation)

    def _reach(self, **changes: int) -> None:
        self.reached = dataclasses.replace(self.reached, **changes)
        self.reached.write(self.folder)


class Tracking:
    """What keeps a run's records up to date, each one a copy of its metrics.

    Args:
        names: of trackers.
        note: told, in a line, what goes wrong.
        required: whether a tracker that cannot be used here is the user's mistake; else it is left out.

    Raises:
        UserError: an unknown name, or a tracker that cannot be used here.
    """

    def __init__(self, names: Sequence[str], note: Callable[[str], None], required: bool = True):
        check_names(names)
        self._note = note
        self._kinds: dict[str, type[Tracker]] = {}
        self._records: list[Record] = []
        for name in names:
            try:
                self._kinds[name] = tracker_class(name)
            except UserError as error:
                if required:
                    raise
                note(f"{error}. {WITHOUT}")

    def open(self, folder: Path, text: str, seeds: tuple[int, ...]) -> None:
        """Begins the records of a run, or goes on with them.

        Args:
            text: the run's resolved configuration, as YAML.
        """
        for name, kind in self._kinds.items():
            with _Contained(name, self._note):
                self._records.append(_open(name, kind, folder, text, seeds))

    def record(self, log: MetricsLog) -> None:
        """The log has grown, and a checkpoint holds what it tells of."""
        self._each(lambda record: record.take(log))

    def conclude(self, evaluation: Evaluation, columns: Callable[[], Columns], figures: Figures) -> None:
        """The run is at its end.

        Args:
            columns: reads all its metrics.
        """
        self._each(lambda record: record.conclude(evaluation, columns, figures))

    def close(self) -> None:
        """Nothing more comes; may be called again."""
        self._each(lambda record: record.tracker.close())
        self._records = []

    def _each(self, do: Callable[[Record], None]) -> None:
        for record in list(self._records):
            with _Contained(record.name, self._note) as contained:
                do(record)
            if contained.failed:
                self._records.remove(record)
                with contextlib.suppress(Exception):
                    record.tracker.close()


@contextlib.contextmanager
def lent(
    tracking: Tracking | None, names: Sequence[str], note: Callable[[str], None], required: bool = True
) -> Generator[Tracking]:
    """One that somebody else has and closes; else one of these names, closed at the end."""
    if tracking is not None:
        yield tracking
        return
    with contextlib.closing(Tracking(names, note, required)) as own:
        yield own


class _Contained:
    """Turns whatever a tracker raises into a note: no record is worth a run."""

    def __init__(self, name: str, note: Callable[[str], None]):
        self._name = name
        self._note = note
        self.failed = False

    def __enter__(self) -> "_Contained":
        return self

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> bool:
        self.failed = isinstance(error, Exception)
        if self.failed:
            said = one_line(str(error).strip() or type(error).__name__)
            # Where a terminal has hung up, nobody can be told.
            with contextlib.suppress(OSError):
                self._note(f"{self._name}: {said}. {WITHOUT}")
        return self.failed


def _open(name: str, kind: type[Tracker], folder: Path, text: str, seeds: tuple[int, ...]) -> Record:
    place = folder / name
    if place.is_symlink():
        raise UserError(
            f"{place}: a link, and what it leads to would be changed; put the folder in its place"
        )
    place.mkdir(exist_ok=True)
    reached = Reached.read(place)
    # An identity must be known before anything is recorded under it.
    reached.write(place)
    begins = reached.generation == 0
    name_of_run = folder.resolve().name
    tracked = Tracked(name_of_run, place, reached.identity, seeds, text, yaml.safe_load(text), begins)
    return Record(name, place, kind(tracked), reached)


def _by_seed(columns: Columns) -> Iterator[tuple[int, Columns]]:
    for seed in dict.fromkeys(columns["seed"].tolist()):
        rows = columns["seed"] == seed
        yield seed, {name: values[rows] for name, values in columns.items() if name != "seed"}


def _scores(evaluation: Evaluation, seed: int) -> dict[str, float]:
    """One champion's scores with the ends of their 95 % intervals, by name."""
    scores: dict[str, float] = {}
    for key, numbers in evaluation.as_dict().items():
        if key == "episodes":
            scores["final/episodes"] = numbers
            continue
        of_seed = next(entry for entry in numbers["per_seed"] if entry["seed"] == seed)
        named = {"": of_seed["mean"], "_low": of_seed["low"], "_high": of_seed["high"]}
        scores |= {f"final/{key}{end}": value for end, value in named.items() if value is not None}
    return scores
