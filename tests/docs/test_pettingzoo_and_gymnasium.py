"""The page, followed word by word, with fewer steps."""

import re
import shlex
from pathlib import Path

import numpy as np
import pytest

from cli.test_commands import call
from skillcrew.envs.checks import play

for package in ("gymnasium", "pettingzoo", "mpe2"):
    pytest.importorskip(package)

PAGE = Path(__file__).parents[2] / "docs" / "tutorials" / "pettingzoo-and-gymnasium.md"
BLOCKS = re.findall(r"```(\w+)\n(.*?)```", PAGE.read_text(), re.DOTALL)
FEWER = {
    "train": (
        "--steps",
        "900",
        "--algorithm.updates",
        "2",
        "--score-episodes",
        "2",
        "--report-episodes",
        "5",
    ),
    "check": ("--environment.episode-length", "9"),
}


def test_its_python_runs(folder):
    names = {}
    for text in (text for kind, text in BLOCKS if kind == "python"):
        exec(text, names)
    assert names["env"].possible_agents == ["agent_0", "agent_1"]
    assert np.isfinite(names["run"].metrics()["fitness_mean"]).all()
    assert names["pendulum"].skills == ("upright", "calm")
    spread = names["spread"]
    assert (spread.n_agents, spread.action_size, spread.actions) == (2, 5, "continuous")


def test_its_commands_run(folder, capsys, monkeypatch):
    monkeypatch.setattr(play, "WORLDS", 16)
    for line in (line for kind, text in BLOCKS if kind == "sh" for line in text.splitlines()):
        program, command, *words = shlex.split(line)
        assert program == "skillcrew"
        assert call([command, *words, *FEWER.get(command, ())]) == 0, capsys.readouterr().err
    assert "20 fresh episodes" in capsys.readouterr().out
