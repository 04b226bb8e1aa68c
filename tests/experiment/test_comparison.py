"""The folder of a comparison."""

import errno
import os

import pytest

import skillcrew as sc
from experiment import made_up
from experiment.tiny import Counting, Toll, contents
from skillcrew.experiment import comparison
from skillcrew.experiment.comparison import Comparison, ComparisonFolder, PlannedRun, first_difference
from skillcrew.experiment.config import RunConfig
from skillcrew.experiment.reproduction import plan
from skillcrew.experiment.score import RETURN, SUCCESS

PURPOSE = "This folder is for a test."


@pytest.fixture
def folder(tmp_path):
    return ComparisonFolder(tmp_path / "deep" / "reproduction")


def test_a_new_folder_explains_itself_and_is_opened_again(folder):
    folder.open(PURPOSE)
    made = contents(folder.path)
    explained = (folder.path / "README.txt").read_text()
    assert explained.startswith(PURPOSE + "\n")
    parts = [path for path in folder.path.iterdir() if path.name not in ("README.txt", folder.about.name)]
    assert {path.name for path in parts} == {"configurations", "figures", "logs", "runs"}
    assert all(f"{path.name}/" in explained for path in parts)
    (folder.path / "runs" / "anything").mkdir()
    ComparisonFolder(str(folder.path)).open("Somebody else's purpose.")
    assert contents(folder.path) == made


def test_it_says_what_methods_are_compared_by(folder, tmp_path):
    folder.open(PURPOSE)
    assert "steps to 0.5 and 0.9, final success, area" in (folder.path / "README.txt").read_text()
    ComparisonFolder(tmp_path / "returns").open(PURPOSE, RETURN)
    explained = (tmp_path / "returns" / "README.txt").read_text()
    assert "environment: final return, area" in explained and "success" not in explained


def test_success_and_returns_are_compared_apart():
    rover, toll = (
        PlannedRun(env.name, "counting", "Counting", Counting(env), RunConfig())
        for env in (sc.make("rover-t2-c1"), Toll())
    )
    assert Comparison("", [rover, rover], []).score is SUCCESS
    assert Comparison("", [toll], []).score is RETURN
    with pytest.raises(sc.UserError, match="compare them apart"):
        _ = Comparison("", [rover, toll], []).score


def test_an_empty_folder_is_taken(tmp_path):
    ComparisonFolder(tmp_path).open(PURPOSE)
    assert (tmp_path / "comparison.json").is_file()


def refused(folder):
    """The one line with which a folder is refused; it stays as it is."""
    above = folder.path if folder.path.is_dir() else folder.path.parent
    before = contents(above)
    with pytest.raises(sc.UserError) as caught:
        folder.open(PURPOSE)
    assert contents(above) == before
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_a_folder_with_something_else_is_refused(tmp_path):
    (tmp_path / "thesis.tex").write_text("years of work")
    assert "holds something else; choose another folder with --out" in refused(ComparisonFolder(tmp_path))


def test_a_file_is_refused(tmp_path):
    (tmp_path / "thesis.tex").write_text("years of work")
    line = refused(ComparisonFolder(tmp_path / "thesis.tex"))
    assert str(tmp_path / "thesis.tex") in line and "directory" in line


@pytest.mark.parametrize(
    "about", ['{"format": 2}', '{"format": 0}', "{}", "[1]", "null", "{", "", b"\xff\xfe"]
)
def test_another_version_or_damage_is_refused(about, folder):
    folder.open(PURPOSE)
    folder.about.write_bytes(about if isinstance(about, bytes) else about.encode())
    line = refused(folder)
    assert str(folder.about) in line and "--out" in line
    assert f"this skillcrew writes {comparison.FORMAT}" in line
    if about == '{"format": 2}':
        assert "format 2" in line


def test_below_a_file_nothing_can_be_made(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(sc.UserError, match="cannot be written, not a directory") as caught:
        ComparisonFolder(tmp_path / "file" / "reproduction").open(PURPOSE)
    assert str(tmp_path / "file" / "reproduction") in str(caught.value)


@pytest.mark.parametrize("code", [errno.EACCES, errno.EROFS])
def test_a_read_only_place_is_one_line_and_left_empty(code, folder, tmp_path, monkeypatch):
    def refuse(*_, **__):
        raise OSError(code, os.strerror(code))

    monkeypatch.setattr("os.mkdir", refuse)
    with pytest.raises(sc.UserError, match=r"you may not write there; .*--out") as caught:
        folder.open(PURPOSE)
    assert str(folder.path) in str(caught.value) and "\n" not in str(caught.value)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("function", ["pathlib.Path.write_text", "tempfile.mkstemp"])
def test_a_disk_that_was_full_at_first_is_no_obstacle_later(function, folder, monkeypatch):
    def full(*_, **__):
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as disk, pytest.raises(sc.UserError, match="the disk is full"):
        disk.setattr(function, full)
        folder.open(PURPOSE)
    folder.open(PURPOSE)
    assert folder.about.is_file() and (folder.path / "README.txt").read_text()


def test_a_folder_that_lost_its_logs_gets_them_again(folder):
    folder.open(PURPOSE)
    (folder.path / "logs").rmdir()
    folder.figures.rmdir()
    folder.configurations.rmdir()
    folder.open(PURPOSE)
    assert (folder.path / "logs").is_dir() and folder.figures.is_dir() and folder.configurations.is_dir()


# What is done


@pytest.fixture
def planned(monkeypatch, folder):
    made_up.shrink(monkeypatch)
    folder.open(PURPOSE)
    return plan(["fig-4.3"], seeds=(4, 2))[1]


def test_a_run_is_done_when_it_has_scores(folder, planned):
    other = plan(["fig-4.3"], seeds=(4, 2))[0]
    assert not folder.is_done(planned)
    made_up.write_run(folder.run(planned), planned, {4: 0.5, 2: 0.75})
    assert not folder.is_done(planned), "it has no scores yet"
    made_up.write_report(folder.run(planned), {4: 1, 2: 2})
    assert folder.is_done(planned)
    assert not folder.is_done(other), "another run was done"
    assert folder.log(planned) != folder.log(other)


@pytest.mark.parametrize(
    ("change", "field", "there", "asked"),
    [
        ({"budget": 0.5}, "algorithm.plateau.latest", None, 21),
        ({"seeds": (4, 2, 7)}, "run.seeds", [4, 2], [4, 2, 7]),
    ],
)
@pytest.mark.parametrize("done", [False, True])
def test_another_configuration_names_the_field_and_both_values(
    change, field, there, asked, done, folder, planned
):
    made_up.write_run(folder.run(planned), planned, {4: 0.5, 2: 0.75})
    if done:
        made_up.write_report(folder.run(planned), {4: 1, 2: 2})
    with pytest.raises(sc.UserError) as caught:
        folder.is_done(plan(["fig-4.3"], **{"seeds": (4, 2), **change})[1])
    line = str(caught.value)
    assert f"{folder.run(planned).config}: {field} is {there} there and {asked} is asked for" in line
    assert "--out" in line and "\n" not in line


@pytest.mark.parametrize("damage", [b"", b"{", b"\xff\xfe", b"run: [", b"- 1"])
def test_a_damaged_configuration_is_one_line(damage, folder, planned):
    made_up.write_run(folder.run(planned), planned, {4: 0.5, 2: 0.75})
    folder.run(planned).config.write_bytes(damage)
    with pytest.raises(sc.UserError) as caught:
        folder.is_done(planned)
    line = str(caught.value)
    assert str(folder.run(planned).config) in line and "\n" not in line and len(line) < 400


def test_what_is_no_run_is_refused(folder, planned):
    folder.run(planned).path.mkdir(parents=True)
    with pytest.raises(sc.UserError, match=r"not a run folder.*config\.yaml"):
        folder.is_done(planned)


@pytest.mark.parametrize(
    ("found", "asked", "difference"),
    [
        ({"a": 1, "b": {"c": [2, 3]}}, {"b": {"c": [2, 3]}, "a": 1}, None),
        ({"a": 1, "b": {"c": [2, 3]}}, {"a": 1, "b": {"c": [2, 4]}}, ("b.c", [2, 3], [2, 4])),
        ({"a": {"b": {"c": 1}}}, {"a": {"b": {"c": 2}}}, ("a.b.c", 1, 2)),
        ({"a": 1}, {"a": 1, "b": 2}, ("b", None, 2)),
        ({"a": 1, "b": {"d": 3}}, {"a": 1, "b": {}}, ("b.d", 3, None)),
        ({"a": 1, "b": 2}, {"a": 3, "b": 4}, ("a", 1, 3)),
        ({"a": {"b": 1}}, {"a": 5}, ("a", {"b": 1}, 5)),
        ({"a": 5}, {"a": {"b": 1}}, ("a", 5, {"b": 1})),
        (None, {"a": 1}, ("the configuration", None, {"a": 1})),
        ({}, {}, None),
    ],
)
def test_the_first_difference_of_nested_configurations(found, asked, difference):
    assert first_difference(found, asked) == difference
