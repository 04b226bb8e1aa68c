"""A reproduction's runs, and the folder that they go into."""

import dataclasses
import errno
import os
import re

import pytest
import yaml

import skillcrew as sc
from experiment import made_up
from experiment.tiny import contents
from skillcrew.algorithms.registry import ALGORITHMS
from skillcrew.envs.presets import PRESETS
from skillcrew.experiment import reproduction
from skillcrew.experiment.config import RunConfig, from_yaml
from skillcrew.experiment.reproduction import (
    FIGURES,
    METHODS,
    SEEDS,
    STEPS,
    ReproductionFolder,
    figures_of,
    first_difference,
    plan,
)

METHODS_OF_THE_THESIS = ("madys", "mfl", "ea")


# What is run


@pytest.fixture(scope="module")
def everything():
    return plan(figures_of("all"))


def test_the_six_configurations_of_the_thesis_with_every_method(everything):
    pairs = [(one.environment, one.method) for one in everything]
    environments = [f"rover-t{types}-c{coupling}" for types in (2, 3) for coupling in (1, 2, 3)]
    assert pairs == [(name, method) for name in environments for method in METHODS]
    assert len({one.name for one in everything}) == len(everything) == 24
    for one in everything:
        assert one.algorithm.name == one.method
        assert one.algorithm.env.name == one.environment
        assert one.algorithm.env.config == PRESETS[one.environment]
        assert one.config == RunConfig(seeds=(2000, 2001, 2002, 2003, 2004), steps=STEPS[one.environment])
        # Nothing but the length of a pre-training ever differs from the defaults.
        assert one.algorithm.config == ALGORITHMS[one.method].config_class()


def test_a_figure_has_its_environments(everything):
    assert figures_of("all") == ("fig-4.2", "fig-4.3")
    names = [[one.name for one in plan(figures_of(figure))] for figure in FIGURES]
    assert [len(part) for part in names] == [12, 12]
    assert names[0] + names[1] == [one.name for one in everything]
    assert all(name.startswith("rover-t2") for name in names[0])


def test_the_thesis_form_has_a_feed_forward_network_for_each_agent(everything):
    for one in everything:
        if one.method in METHODS_OF_THE_THESIS:
            policy = getattr(one.algorithm.config, "selector", None) or one.algorithm.config.actor
            assert (policy.memory, policy.sharing) == (0, "agent"), one.name


def test_an_unknown_figure_lists_what_there_is():
    with pytest.raises(sc.UserError) as caught:
        figures_of("fig-4.4")
    line = str(caught.value)
    assert line.startswith("unknown figure 'fig-4.4'; valid, nearest first: fig-4.2, fig-4.3, ")
    assert all(name in line for name in (*STEPS, "all"))


@pytest.mark.parametrize("environment", STEPS)
def test_an_environment_is_a_figure_of_its_own(environment, everything):
    """With the very runs that the thesis's figure has there."""
    alone = plan(figures_of(environment))
    assert [one.method for one in alone] == list(METHODS)
    among_all = [one for one in everything if one.environment == environment]
    assert [one.to_yaml() for one in alone] == [one.to_yaml() for one in among_all]


def test_the_budget_scales_steps_and_the_time_that_skills_learn():
    full, half = plan(["fig-4.3"]), plan(["fig-4.3"], budget=0.5)
    for whole, part in zip(full, half, strict=True):
        assert part.config == dataclasses.replace(whole.config, steps=whole.config.steps // 2)
        before = yaml.safe_load(whole.to_yaml())["algorithm"]
        after = yaml.safe_load(part.to_yaml())["algorithm"]
        if whole.method != "ea":
            rule = before["plateau"]
            assert rule.pop("latest") is None
            assert after["plateau"].pop("latest") == (rule["earliest"] + rule["window"]) / 2 + 1
        if whole.method == "mfl":
            assert after.pop("pretraining_steps") == before.pop("pretraining_steps") / 2 > 0
        assert before == after, "the budget changes nothing else"


def test_a_tiny_budget_still_lets_every_method_live():
    for one in plan(["fig-4.2"], budget=1e-9):
        assert one.config.steps == reproduction.LEAST_STEPS == 200_000
        assert getattr(one.algorithm.config, "pretraining_steps", 1) == 1
        if one.method != "ea":
            assert one.algorithm.config.plateau.latest == 2
    # The floor is for the small ones alone.
    steps = {one.environment: one.config.steps for one in plan(["fig-4.2"], budget=0.03)}
    assert steps == {"rover-t2-c1": 200_000, "rover-t2-c2": 480_000, "rover-t2-c3": 360_000}


def test_seeds_are_passed_on():
    assert SEEDS == (2000, 2001, 2002, 2003, 2004)
    assert {one.config.seeds for one in plan(["fig-4.2"], seeds=(9, 4, 1))} == {(9, 4, 1)}
    with pytest.raises(sc.UserError, match=r"seeds = \[1, 1\].*each once"):
        plan(["fig-4.2"], seeds=(1, 1))


@pytest.mark.parametrize("budget", [0.0, -0.5, 1.01, float("nan"), float("inf")])
def test_what_is_no_share_is_refused_with_the_mend(budget):
    with pytest.raises(sc.UserError) as caught:
        plan(["fig-4.2"], budget=budget)
    assert str(caught.value) == f"--budget {budget}: give a share above 0 and up to 1, such as 0.02"


def test_a_configuration_file_makes_the_same_run_again(everything, tmp_path):
    for one in everything[:4]:
        path = tmp_path / "config.yaml"
        path.write_text(one.to_yaml())
        algorithm, config = from_yaml(path)
        assert (algorithm.name, algorithm.config, config) == (one.method, one.algorithm.config, one.config)
        assert algorithm.env.config == one.algorithm.env.config


# The folder


@pytest.fixture
def folder(tmp_path):
    return ReproductionFolder(tmp_path / "deep" / "reproduction")


def test_a_new_folder_explains_itself_and_is_opened_again(folder):
    folder.open()
    made = contents(folder.path)
    explained = (folder.path / "README.txt").read_text()
    parts = [path for path in folder.path.iterdir() if path.name not in ("README.txt", folder.about.name)]
    assert {path.name for path in parts} == {"configurations", "figures", "logs", "runs"}
    assert all(f"{path.name}/" in explained for path in parts)
    (folder.path / "runs" / "anything").mkdir()
    ReproductionFolder(str(folder.path)).open()
    assert contents(folder.path) == made


def test_an_empty_folder_is_taken(tmp_path):
    ReproductionFolder(tmp_path).open()
    assert (tmp_path / "reproduction.json").is_file()


def refused(folder):
    """The one line with which a folder is refused; it stays as it is."""
    above = folder.path if folder.path.is_dir() else folder.path.parent
    before = contents(above)
    with pytest.raises(sc.UserError) as caught:
        folder.open()
    assert contents(above) == before
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_a_folder_with_something_else_is_refused(tmp_path):
    (tmp_path / "thesis.tex").write_text("years of work")
    assert "holds something else; choose another folder with --out" in refused(ReproductionFolder(tmp_path))


def test_a_file_is_refused(tmp_path):
    (tmp_path / "thesis.tex").write_text("years of work")
    line = refused(ReproductionFolder(tmp_path / "thesis.tex"))
    assert str(tmp_path / "thesis.tex") in line and "directory" in line


@pytest.mark.parametrize(
    "about", ['{"format": 2}', '{"format": 0}', "{}", "[1]", "null", "{", "", b"\xff\xfe"]
)
def test_another_version_or_damage_is_refused(about, folder):
    folder.open()
    folder.about.write_bytes(about if isinstance(about, bytes) else about.encode())
    line = refused(folder)
    assert str(folder.about) in line and "--out" in line
    assert f"this skillcrew writes {reproduction.FORMAT}" in line
    if about == '{"format": 2}':
        assert "format 2" in line


def test_below_a_file_nothing_can_be_made(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(sc.UserError, match="cannot be written, not a directory") as caught:
        ReproductionFolder(tmp_path / "file" / "reproduction").open()
    assert str(tmp_path / "file" / "reproduction") in str(caught.value)


@pytest.mark.parametrize("code", [errno.EACCES, errno.EROFS])
def test_a_read_only_place_is_one_line_and_left_empty(code, folder, tmp_path, monkeypatch):
    def refuse(*_, **__):
        raise OSError(code, os.strerror(code))

    monkeypatch.setattr("os.mkdir", refuse)
    with pytest.raises(sc.UserError, match=r"you may not write there; .*--out") as caught:
        folder.open()
    assert str(folder.path) in str(caught.value) and "\n" not in str(caught.value)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("function", ["pathlib.Path.write_text", "tempfile.mkstemp"])
def test_a_disk_that_was_full_at_first_is_no_obstacle_later(function, folder, monkeypatch):
    def full(*_, **__):
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as disk, pytest.raises(sc.UserError, match="the disk is full"):
        disk.setattr(function, full)
        folder.open()
    folder.open()
    assert folder.about.is_file() and (folder.path / "README.txt").read_text()


def test_a_folder_that_lost_its_logs_gets_them_again(folder):
    folder.open()
    (folder.path / "logs").rmdir()
    folder.figures.rmdir()
    folder.configurations.rmdir()
    folder.open()
    assert (folder.path / "logs").is_dir() and folder.figures.is_dir() and folder.configurations.is_dir()


# What is done


@pytest.fixture
def planned(monkeypatch, folder):
    made_up.shrink(monkeypatch)
    folder.open()
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


def test_every_planned_name_is_a_plain_file_name(everything):
    assert all(re.fullmatch(r"[a-z0-9-]+", one.name) for one in everything)
