"""The tutorial, followed word by word."""

import json
import re
import shlex
from pathlib import Path

from cli.test_commands import call

TEXT = (Path(__file__).parents[2] / "docs" / "tutorials" / "your-own-world.md").read_text()
BLOCKS = re.findall(r"```(\w+)\n(.*?)```", TEXT, re.DOTALL)


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
