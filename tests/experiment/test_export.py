"""A champion that left the library does what it did there."""

import ast
import functools
import json
import os
import shutil
from pathlib import Path

import numpy as np
import pytest
import safetensors.numpy

import skillcrew as sc
from experiment import tiny
from experiment.exported import TEAMS, Subject, one_by_one, program_in, side_by_side, write
from skillcrew.experiment.export import writing
from skillcrew.experiment.export.description import digest
from skillcrew.experiment.export.structure import taken_apart
from skillcrew.experiment.export.writing import files_of

ACTING = Path(writing.__file__).with_name("acting")

NEEDS = {
    "act_numpy": {"json", "pathlib", "numpy"},
    "act_onnx": {"json", "pathlib", "numpy", "onnxruntime"},
    "act_stablehlo": {"json", "pathlib", "jax", "jax.numpy"},
}


@functools.cache
def subject(kind):
    return Subject(kind)


@pytest.mark.parametrize("kind", TEAMS)
def test_every_form_acts_as_the_team_does(kind, tmp_path):
    one = subject(kind)
    folder = write(one.files, tmp_path / "team")
    told = json.loads((folder / "team.json").read_text())
    expected = one.played_by(one.team)
    assert set(expected) == {about["name"] for about in (*told["outputs"], *told["memory"])}
    draws = {about["name"]: one.uniform(about["shape"]) for about in told["draws"]}
    assert bool(draws) == kind.startswith("drawn")
    for name, played in (
        ("act_numpy", one_by_one),
        ("act_onnx", one_by_one),
        ("act_stablehlo", side_by_side),
    ):
        found = played(one, program_in(folder, name), draws)
        assert set(found) == set(expected)
        for what, values in expected.items():
            np.testing.assert_allclose(found[what], values, rtol=0, atol=1e-5, err_msg=f"{name}: {what}")
    for what, values in one.played_by(sc.load_team(folder)).items():
        np.testing.assert_array_equal(values, expected[what], err_msg=what)


def test_no_acting_program_needs_skillcrew():
    for name, needed in NEEDS.items():
        text = (ACTING / f"{name}.py").read_text()
        tree = ast.walk(ast.parse(text))
        assert {word.name for node in tree if isinstance(node, ast.Import) for word in node.names} <= needed
        assert "ImportFrom" not in ast.dump(ast.parse(text))
        assert len(text.splitlines()) <= 30


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    """A team that was exported. Read only: copy it before changing anything."""
    return write(subject("reactive timetables that hold").files, tmp_path_factory.mktemp("exported") / "team")


def changed(description):
    """A change of what `team.json` says, as a change of a folder."""

    def change(folder):
        path = folder / "team.json"
        told = json.loads(path.read_text())
        description(told)
        path.write_text(json.dumps(told))

    return change


def selector(told):
    return told["policy"]["selectors"]["selector"]


def network(told):
    return selector(told)["network"]["network"]


def other_tensors(folder, **arrays):
    """Other arrays, which the description knows of."""
    path = folder / "team.safetensors"
    data = safetensors.numpy.save({**safetensors.numpy.load(path.read_bytes()), **arrays})
    path.write_bytes(data)
    changed(lambda told: told.update(sha256=digest(data, told["policy"])))(folder)


BIAS = "policy/selectors/selector/network/network/biases/0"

CONTRADICTION = {"kind": "Options", "size": 2, "continuous": True, "available": [[True]]}

WRONG = {
    "cut off": (
        lambda folder: os.truncate(folder / "team.safetensors", 900),
        r"team\.safetensors: damaged or cut off",
    ),
    "a bit": (
        lambda folder: (folder / "team.safetensors").write_bytes(
            (folder / "team.safetensors").read_bytes()[:-1] + b"\x7f"
        ),
        r"team\.safetensors: damaged, or team\.json is; export the team again",
    ),
    "gone": (lambda folder: (folder / "team.safetensors").unlink(), r"team\.safetensors: missing"),
    "no description": (lambda folder: (folder / "team.json").unlink(), r"no exported team"),
    "no JSON": (lambda folder: (folder / "team.json").write_text("[" * 100_000), r"team\.json: damaged"),
    "another JSON": (lambda folder: (folder / "team.json").write_text("[3]"), r"team\.json: damaged"),
    "newer": (changed(lambda told: told.update(format=2)), r"newer skillcrew \(team format 2, .*upgrade"),
    "a stranger's class": (
        changed(lambda told: told["policy"].update(kind="os.system")),
        r"unknown kind in policy 'os\.system'; valid",
    ),
    "no word for a class": (
        changed(lambda told: told["policy"].update(kind=["SkillTeam"])),
        r"unknown kind in policy ",
    ),
    "another number": (
        changed(lambda told: selector(told).update(episode_length=51)),
        r"damaged, or team\.json is",
    ),
    "a field too many": (
        changed(lambda told: told["policy"].update(more=1)),
        r"policy: a SkillTeam needs the fields",
    ),
    "an absurd shape": (
        changed(lambda told: network(told)["weights"][0].update(shape=[10**9, 10**9])),
        r"weights/0: its shape is \[1000000000, 1000000000\], larger than in any team",
    ),
    "an absurd number": (
        changed(lambda told: told["policy"].update(n_agents=10**12)),
        r"policy/n_agents = 1000000000000: no number in a team is larger",
    ),
    "a length below 0": (
        changed(lambda told: network(told)["weights"][0].update(shape=[-1, 2])),
        r"weights/0: its shape is \[-1, 2\], which are no lengths",
    ),
    "a shape that would broadcast": (
        changed(lambda told: network(told)["biases"][0].update(shape=[3, 1])),
        r"biases/0: is \[3, 1\], and beside the others has to be \[3, 6\]",
    ),
    "a shape that does not fit": (
        changed(lambda told: network(told)["weights"][0].update(shape=[3, 8, 9])),
        r"biases/0: is \[3, 6\], and beside the others has to be \[3, 9\]",
    ),
    "phases without lengths": (
        changed(lambda told: selector(told)["timetable"]["lengths"].update(shape=[3, 4])),
        r"timetable/lengths: is \[3, 4\], and beside the others has to be \[3, 5\]",
    ),
    "a larger memory": (
        changed(lambda told: selector(told)["network"]["unit"].update(hidden_size=1_000_000)),
        r"unit/weight_ih: is \[3, 9, 5\], and beside the others has to be \[3, 3000000, 5\]",
    ),
    "no array": (
        changed(lambda told: network(told).update(weights=[1.5, 2.5])),
        r"policy/selectors/selector/network/network: is no MLP",
    ),
    "a class that does not take its fields": (
        changed(lambda told: told["policy"].update(repertoire=[CONTRADICTION])),
        r"its parts do not fit together",
    ),
    "too few agents": (
        changed(lambda told: told["policy"].update(n_agents=2)),
        r"its parts do not fit together",
    ),
    "another observation": (
        changed(lambda told: told["observation"][0].update(shape=[3, 13])),
        r"its parts do not fit together",
    ),
    "another action": (
        changed(lambda told: told["outputs"][0].update(shape=[3, 3])),
        r"action is float32\[3, 3\], and its arrays make it float32\[3, 2\]",
    ),
    "other words": (
        changed(lambda told: told["policy"].update(repertoire="abc")),
        r"its parts do not fit together",
    ),
    "another array": (
        lambda folder: other_tensors(folder, **{BIAS: np.zeros((3, 9), np.float32)}),
        r"biases/0 is \(\(3, 9\), 'F32'\), and team\.json asks for \(\(3, 6\), 'F32'\)",
    ),
    "another type": (
        lambda folder: other_tensors(folder, **{BIAS: np.zeros((3, 6), np.float64)}),
        r"biases/0 is \(\(3, 6\), 'F64'\)",
    ),
}


@pytest.mark.parametrize("how", WRONG)
def test_a_team_that_is_not_as_it_was_written_is_refused_in_one_line(how, exported, tmp_path):
    change, line = WRONG[how]
    folder = shutil.copytree(exported, tmp_path / "team")
    change(folder)
    with pytest.raises(sc.UserError, match=line):
        sc.load_team(folder)


def test_a_team_without_safetensors_cannot_be_read_back(exported, tmp_path):
    one = subject("a trunk with heads")
    folder = write(files_of(one.team, one.shapes, {"format": 1}, ["onnx"]), tmp_path / "team")
    assert sorted(path.name for path in folder.iterdir()) == ["act_onnx.py", "team.json", "team.onnx"]
    with pytest.raises(sc.UserError, match=r"policy: is missing; export the team with safetensors"):
        sc.load_team(folder)


def test_a_team_of_no_kind_that_is_known_is_refused_by_name():
    with pytest.raises(sc.UserError, match=r"policy: is a CountdownTeam"):
        taken_apart(tiny.CountdownTeam(np.zeros(1)))
