"""Records that TensorBoard shows: a folder of event files for each seed.

Written record by record, with TensorBoard's own formats: its `summary.Writer` knows neither pictures nor
configurations, and its other writer imports TensorFlow wherever that is installed.
"""

import os
import struct
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml
from tensorboard.compat.proto import event_pb2, summary_pb2
from tensorboard.plugins.hparams.summary_v2 import hparams_pb
from tensorboard.plugins.text.metadata import create_summary_metadata
from tensorboard.summary.writer.record_writer import RecordWriter
from tensorboard.util.tensor_util import make_tensor_proto

from skillcrew.experiment.metrics import Columns
from skillcrew.experiment.trackers.tracker import Tracked, finite


class TensorBoard:
    """Keeps records in `RUN/tensorboard/seed-…`; see `Tracker`."""

    def __init__(self, tracked: Tracked):
        self._tracked = tracked
        self._files: dict[int, EventFile] = {}

    @staticmethod
    def check() -> None:
        """There is nothing to set up."""

    def record(self, seed: int, columns: Columns) -> None:
        """One event for each row, all columns in it."""
        steps = columns["environment_steps"].tolist()
        file = self._file(seed, steps[0])
        for row, step in enumerate(steps):
            summary = summary_pb2.Summary()
            for name, value in finite(columns, row).items():
                summary.value.add(tag=name, simple_value=value)
            file.write(step, summary=summary)

    def conclude(
        self, seed: int, steps: int, scores: Mapping[str, float], figures: Mapping[str, Path]
    ) -> None:
        """Scores as scalars, figures as images."""
        file = self._file(seed, steps + 1)
        summary = summary_pb2.Summary()
        for name, value in scores.items():
            summary.value.add(tag=name, simple_value=value)
        for name, path in figures.items():
            summary.value.add(tag=name, image=_image(path))
        file.write(steps, summary=summary)

    def flush(self) -> None:
        """Gives the files to the system."""
        for file in self._files.values():
            file.flush()

    def close(self) -> None:
        """Closes the files."""
        for file in self._files.values():
            file.close()

    def _file(self, seed: int, step: int) -> "EventFile":
        """The file that this process writes for a seed, made with the first thing that goes into it."""
        if seed not in self._files:
            file = EventFile(self._tracked.place / f"seed-{seed}")
            self._files[seed] = file
            begin = 0 if self._tracked.begins else step
            # What a process wrote that was killed before it could note it is forgotten, and comes again.
            file.write(begin, session_log=event_pb2.SessionLog(status=event_pb2.SessionLog.START))
            file.write(begin, summary=_text("configuration", f"```yaml\n{self._tracked.text}```"))
            if self._tracked.begins:
                values = {"seed": seed, **_flat(self._tracked.configuration)}
                file.write(begin, summary=hparams_pb(values, trial_id=f"{self._tracked.run}-{seed}"))
        return self._files[seed]


class EventFile:
    """One file of events, which TensorBoard reads while it grows."""

    def __init__(self, folder: Path):
        folder.mkdir(parents=True, exist_ok=True)
        # They are read in the order of their names.
        name = f"events.out.tfevents.{time.time_ns() // 1_000_000}.{os.getpid()}"
        self._file = (folder / name).open("xb")
        self._records = RecordWriter(self._file)
        self.write(0, file_version="brain.Event:2")

    def write(self, step: int, **what: Any) -> None:
        """Adds an event."""
        event = event_pb2.Event(wall_time=time.time(), step=step, **what)
        self._records.write(event.SerializeToString())

    def flush(self) -> None:
        self._file.flush()

    def close(self) -> None:
        self._file.close()


def _flat(values: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Each field under its path, such as `algorithm.population`; lists as they are in YAML."""
    flat: dict[str, Any] = {}
    for name, value in values.items():
        if isinstance(value, Mapping):
            flat |= _flat(value, f"{prefix}{name}.")
        elif isinstance(value, bool | int | float | str):
            flat[f"{prefix}{name}"] = value
        else:
            flat[f"{prefix}{name}"] = yaml.safe_dump(value, default_flow_style=True).split("\n")[0]
    return flat


def _text(tag: str, text: str) -> summary_pb2.Summary:
    metadata = create_summary_metadata(display_name=tag, description="")
    value = summary_pb2.Summary.Value(
        tag=tag, metadata=metadata, tensor=make_tensor_proto([text.encode()], shape=(1,))
    )
    return summary_pb2.Summary(value=[value])


def _image(path: Path) -> summary_pb2.Summary.Image:
    encoded = path.read_bytes()
    width, height = struct.unpack(">II", encoded[16:24])
    return summary_pb2.Summary.Image(width=width, height=height, colorspace=4, encoded_image_string=encoded)
