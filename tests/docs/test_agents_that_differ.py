"""The page, followed word by word."""

import re
import shlex
from pathlib import Path

from cli.test_commands import call

TEXT = (Path(__file__).parents[2] / "docs" / "tutorials" / "agents-that-differ.md").read_text()
BLOCKS = re.findall(r"```(\w+)\n(.*?)```", TEXT, re.DOTALL)


def test_both_teams_are_trained(folder, compiled_for_users, capsys):
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
