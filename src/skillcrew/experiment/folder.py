"""One run is one folder, which explains itself."""

import importlib.metadata
import os
import platform
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import jax

from skillcrew.errors import UserError
from skillcrew.experiment.files import disk_errors
from skillcrew.experiment.integrity import write_known

EXPLANATION = """\
This folder is one run of skillcrew.

config.yaml        every option, also those left at their defaults; `skillcrew train --config` takes it
metrics.parquet    one row per seed and generation (pandas, polars, R and DuckDB read it)
timing.json        seconds spent on compiling and on running, environment steps per second
checkpoints/       everything that the run goes on from, by generation: the latest and the best
report/            report.html to look at; learning curve and chosen skills, as PNG and PDF; scores
tensorboard/       where that was asked for, a record for TensorBoard; wandb/ one for Weights & Biases
environment.txt    versions, device and command
owner.lock         held by the process that trains here
digests.json       of config.yaml and metrics.parquet, so that damage is noticed; checkpoints have theirs

skillcrew resume .        goes on after an interruption, to the same bits
skillcrew evaluate .      scores the champions on fresh episodes
skillcrew report .        draws the report again
"""


class RunFolder:
    """Where each file of a run is."""

    def __init__(self, path: Path | str):
        self.path = Path(path)
        self.config = self.path / "config.yaml"
        self.metrics = self.path / "metrics.parquet"
        self.timing = self.path / "timing.json"
        self.checkpoints = self.path / "checkpoints"
        self.report = self.path / "report"
        self.scores = self.report / "scores.json"

    def create(self, config: str) -> None:
        """Makes the folder with its configuration, or leaves nothing behind.

        Raises:
            UserError: it exists already, or cannot be written.
        """
        if os.path.lexists(self.path):
            raise UserError(
                f"{self.path}: exists and is never overwritten; `skillcrew resume {self.path}` goes on "
                "with it, --out chooses another folder"
            )
        # Filled under another name first: a kill at any instant leaves no folder that is half a run.
        filling = RunFolder(self.path.with_name(f".{self.path.name}.{os.getpid()}"))
        try:
            with disk_errors(self.path):
                filling.path.mkdir(parents=True)
                write_known(filling.config, lambda path: path.write_text(config))
                for name, text in (("environment.txt", describe_environment()), ("README.txt", EXPLANATION)):
                    (filling.path / name).write_text(text)
                filling.path.rename(self.path)
        finally:
            shutil.rmtree(filling.path, ignore_errors=True)

    def check_is_run(self) -> None:
        """Raises `UserError` if this is no run folder."""
        if not os.path.isdir(self.path):
            raise UserError(f"{self.path}: no such run folder; `skillcrew train` makes one")
        if not os.path.isfile(self.config):
            raise UserError(f"{self.path}: not a run folder of skillcrew (it has no config.yaml)")

    def check_own(self) -> None:
        """Raises `UserError` if what is written here would be written elsewhere, or cannot be."""
        for path in (self.checkpoints, self.report):
            if path.is_symlink():
                raise UserError(
                    f"{path}: a link, and what it leads to would be changed; put the folder in its place"
                )
            if path.exists() and not path.is_dir():
                raise UserError(f"{path}: stands where a folder is to be; move it away")


def describe_environment() -> str:
    """Versions, device, command and, in a git checkout, the commit, one a line."""
    packages = ("skillcrew", "jax", "jaxlib", "equinox", "optax", "flashbax", "orbax-checkpoint", "numpy")
    lines = [f"{name} {_version(name)}" for name in packages]
    lines.append(f"python {platform.python_version()} on {platform.platform()}")
    lines.append(f"device {jax.devices()[0].device_kind} x {jax.device_count()}")
    if commit := _commit():
        lines.append(f"commit {commit}")
    lines.append("command " + shlex.join([Path(sys.argv[0]).name, *sys.argv[1:]]))
    return "\n".join(lines) + "\n"


def _commit() -> str:
    """The commit of the checkout that skillcrew is imported from, and whether that was changed since."""
    package = Path(__file__).parents[1]

    def git(*words: str) -> str:
        command = ["git", "-C", str(package), *words]
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()

    try:
        # An installed package may lie in a checkout of something else.
        git("ls-files", "--error-unmatch", "__init__.py")
        changed = git("status", "--porcelain", "--untracked-files=no", ".")
        return git("rev-parse", "HEAD") + (" with changes" if changed else "")
    except (OSError, subprocess.CalledProcessError):
        return ""


def _version(package: str) -> str:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "(not installed as a package)"
