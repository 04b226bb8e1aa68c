"""The tutorial on JaxMARL, followed word by word, with fewer steps."""

import re
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("jaxmarl")

TEXT = (Path(__file__).parents[2] / "docs" / "tutorials" / "jaxmarl.md").read_text()
BLOCKS = re.findall(r"```(\w+)\n(.*?)```", TEXT, re.DOTALL)
SMALL = "population=7, episodes=1, probe_episodes=1, updates=2"
FEWER = {"steps=3e5": "steps=300", "sc.MADyS(env)": f"sc.MADyS(env, {SMALL})"}


def test_it_ends_with_a_team_that_is_scored_and_a_world_for_jaxmarl(folder, capsys):
    skills, train, again, out = (text for kind, text in BLOCKS if kind == "python")
    (folder / "spread_skills.py").write_text(skills)
    for there, instead in FEWER.items():
        assert there in train
        train = train.replace(there, instead)
    names = {}
    exec(train, names)
    assert np.fromstring(capsys.readouterr().out.strip("[]\n"), sep=" ").shape == (2,)
    exec(again, names)
    assert capsys.readouterr().out == "('go_to_first', 'go_to_second') True\n"
    exec(out, names)
    assert names["done"]["__all__"]
    assert names["info"]["returned_episode_returns"].shape == (2,)
