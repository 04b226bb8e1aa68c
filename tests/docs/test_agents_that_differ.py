"""The page, followed word by word."""

import re
import shlex
import sys
from pathlib import Path

import jax
import pytest

from cli.test_commands import call
from experiment import tiny

TEXT = (Path(__file__).parents[2] / "docs" / "tutorials" / "agents-that-differ.md").read_text()
BLOCKS = re.findall(r"```(\w+)\n(.*?)```", TEXT, re.DOTALL)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    tiny.compile_once()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    with jax.numpy_rank_promotion("allow"), jax.numpy_dtype_promotion("standard"):
        yield tmp_path
    sys.modules.pop("survey", None)


def test_both_teams_are_trained(folder, capsys):
    world, script = (text for kind, text in BLOCKS if kind == "python")
    (folder / "survey.py").write_text(world)
    said = []
    for line in (line for kind, text in BLOCKS if kind == "sh" for line in text.splitlines()):
        program, *words = shlex.split(line)
        assert program == "skillcrew"
        assert call(words) == 0, line
        said.append(capsys.readouterr().out)
    assert said[0].endswith("Nothing is wrong.\n")
    assert float(re.search(r"success\s+(\S+)", said[1])[1]) > 0.9
    assert float(re.search(r"success\s+(\S+)", said[2])[1]) > 0.2
    names = {}
    exec(script, names)
    assert set(names["action"]) == set(names["choice"]) == {"drone", "rover"}
    assert names["action"]["rover"].shape == (1, 2)
