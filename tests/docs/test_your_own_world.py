"""The tutorial, followed word by word."""

import json
import re
import shlex
import sys
from pathlib import Path

import jax
import pytest

from cli.test_commands import call
from experiment import tiny

TEXT = (Path(__file__).parents[2] / "docs" / "tutorials" / "your-own-world.md").read_text()
BLOCKS = re.findall(r"```(\w+)\n(.*?)```", TEXT, re.DOTALL)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    tiny.compile_once()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    # A user's JAX promotes; ours is kept from it, under test.
    with jax.numpy_rank_promotion("allow"), jax.numpy_dtype_promotion("standard"):
        yield tmp_path
    sys.modules.pop("rescue", None)


def test_it_ends_with_a_team_that_is_trained_and_scored(folder, capsys):
    world, script = (text for kind, text in BLOCKS if kind == "python")
    assert len(world.splitlines()) < 80
    (folder / "rescue.py").write_text(world)
    said = {}
    for line in (line for kind, text in BLOCKS if kind == "sh" for line in text.splitlines()):
        program, command, *words = shlex.split(line)
        assert program == "skillcrew"
        assert call([command, *words]) == 0, line
        said[command] = capsys.readouterr().out
    assert said["check"].endswith("Nothing is wrong.\n")
    assert "How close a boat has to come" in said["train"]
    assert json.loads(said["evaluate"])["success_rate"]["mean"] > 0.95
    assert list((folder / "runs" / "rescue" / "report").glob("*.png"))
    names = {}
    exec(script, names)
    assert names["finished"], "the champion finishes, as it did in 0.95 of the episodes"
