"""Stands in the place of training: copies runs that were made up."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from experiment import made_up
from skillcrew.cli import jobs
from skillcrew.experiment.comparison import PlannedRun
from skillcrew.experiment.folder import RunFolder

BySeed = Mapping[int, float]

# Trains or goes on with a run by copying one that was made up. One of them may fail at first, or
# interrupt the command and save what it has.
STUB = """
import os, shutil, signal, sys, time
from pathlib import Path
_, command, *words = sys.argv[1:]
templates, order = Path(os.environ["TEMPLATES"]), Path(os.environ["ORDER"])
if command == "train":
    assert (words[0], words[2]) == ("--config", "--out"), words
    out, name = Path(words[3]), Path(words[1]).stem
else:
    out = Path(words[0])
    assert words[1:] == ["--trackers", "none"], words
    name = "-".join(out.parts[-2:])
with order.open("a") as file:
    file.write(command + " " + name + "\\n")
print("working on", name, flush=True)
if name == os.environ.get("FAIL"):
    print("RuntimeError: out of luck", flush=True)
    sys.exit(1)
if command == "train":
    out.mkdir()
    shutil.copy(words[1], out / "config.yaml")
if name == os.environ.get("INTERRUPT"):
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(130))
    os.kill(os.getppid(), signal.SIGINT)
    time.sleep(60)
shutil.copy(templates / name / "metrics.parquet", out)
shutil.copytree(templates / name / "report", out / "report")
"""


def install(
    monkeypatch,
    here: Path,
    runs: Sequence[PlannedRun],
    results: Callable[[int], tuple[BySeed, Mapping[int, int]]],
) -> Callable[[], list[str]]:
    """Puts the stub in the place of training; returns a function of what it was asked to do, in order.

    Args:
        results: of each run, by its index: how high each seed's curve climbs, and its episodes solved.
    """
    for index, one in enumerate(runs):
        template = RunFolder(here / one.name)
        heights, wins = results(index)
        made_up.write_run(template, one, heights)
        made_up.write_report(template, wins)
    monkeypatch.setenv("TEMPLATES", str(here))
    monkeypatch.setenv("ORDER", str(here / "order"))
    monkeypatch.setattr(jobs, "START", STUB)
    monkeypatch.setattr(jobs, "POLL_SECONDS", 0.01)
    return lambda: (here / "order").read_text().splitlines()
