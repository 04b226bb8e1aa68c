"""Environments by name, by entry point and by import path."""

import sys

import pytest

import skillcrew as sc
from envs.stranger import WORLD, write_package
from skillcrew.envs import registry
from skillcrew.envs.rescue import presets as rescue
from skillcrew.envs.rover import presets as rover
from skillcrew.envs.warehouse import presets as warehouse


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The folder that a stranger works in."""
    monkeypatch.chdir(tmp_path)
    # Without "", the current folder, which `python -m pytest` puts there and `skillcrew` does not.
    monkeypatch.setattr(sys, "path", [entry for entry in sys.path if entry])
    yield tmp_path
    for name in [name for name in sys.modules if name.partition(".")[0] in ("line_lab", "lines")]:
        del sys.modules[name]


@pytest.fixture
def package(folder):
    return write_package(folder)


@pytest.fixture
def installed(folder, monkeypatch):
    """A package that offers two environments, of which one cannot be imported."""
    places = {"line": "line_lab.worlds:LineWorld", "licensed": "line_lab.broken:World"}
    write_package(folder / "site", places)
    monkeypatch.syspath_prepend(str(folder / "site"))


def test_every_preset_of_ours_is_made_by_its_name():
    ours = {**rover.PRESETS, **rescue.PRESETS, **warehouse.PRESETS}
    for name, config in ours.items():
        entry = registry.find(name)
        assert (entry.name, entry.config, entry.by_path) == (name, config, False)
        assert name.startswith(registry.environment_class(entry.place).name)
    assert sc.make("rover-t3-c2", n_agents=5).config.n_agents == 5
    assert list(ours) == registry.names()


def test_an_import_path_is_looked_for_where_the_user_is(package):
    env = sc.make("line_lab.worlds:LineWorld", probes=4)
    assert (env.name, env.n_agents, env.config.reach) == ("line-world", 4, 0.5)
    assert env.describe() == {"name": "line-world", "probes": 4, "reach": 0.5}
    assert registry.place_of(env) == "line_lab.worlds:LineWorld"
    assert registry.find("line_lab.worlds:LineWorld").by_path


def test_a_preset_of_an_import_path(package):
    narrow = sc.make("line_lab.worlds:LineWorld/narrow", probes=3)
    assert (narrow.name, narrow.n_agents, narrow.config.reach) == ("line-world-narrow", 3, 0.1)
    assert sc.make("line_lab.worlds:LineWorld/line-world-of-three").name == "line-world-of-three"
    with pytest.raises(sc.UserError, match=r"preset of .* 'narow'; valid, nearest first: narrow"):
        sc.make("line_lab.worlds:LineWorld/narow")


def test_a_file_is_as_good_as_a_module(folder):
    (folder / "deep").mkdir()
    (folder / "deep" / "lines.py").write_text(WORLD)
    env = sc.make("deep/lines.py:LineWorld/narrow", probes=3)
    assert (env.name, env.n_agents) == ("line-world-narrow", 3)
    assert type(sc.make(f"{folder}/deep/lines.py:LineWorld")) is type(env), "the same file is imported once"
    assert registry.place_of(env) == f"{folder}/deep/lines.py:LineWorld", "found from anywhere"


def test_an_environment_without_options(package):
    assert sc.make("line_lab.worlds:Bare").n_agents == 2
    with pytest.raises(sc.UserError, match="probes: bare has no options; leave it out"):
        sc.make("line_lab.worlds:Bare", probes=3)


@pytest.mark.parametrize(
    ("path", "parts"),
    [
        ("line_lbb.worlds:LineWorld", ["no module line_lbb here", "install"]),
        ("line_lab.world:LineWorld", ["no module line_lab.world here"]),
        ("line_lab.worlds:LineWrld", ["name in line_lab.worlds 'LineWrld'", "first: LineWorld"]),
        ("line_lab.worlds:NotAWorld", ["a class, and no subclass of skillcrew.Environment"]),
        ("line_lab.worlds:not_a_class", ["int, and no subclass"]),
        ("line_lab.broken:World", ["RuntimeError: no licence for the simulator", "broken.py, line 3"]),
        ("skillcrew:Environment", ["what environments are derived from", "give a class of yours"]),
        ("missing.py:LineWorld", ["no file", "missing.py"]),
        ("line_lab.worlds:", ["give module:Name"]),
        ("line_lab:LineWorld", ["line_lab has no LineWorld"]),
    ],
)
def test_what_is_wrong_with_an_import_path_is_one_line(path, parts, package):
    with pytest.raises(sc.UserError) as caught:
        sc.make(path)
    line = str(caught.value)
    assert "\n" not in line and line.startswith((path, "unknown name"))
    for part in parts:
        assert part in line


def test_a_module_that_misses_another_is_not_said_to_be_missing_itself(package):
    (package / "line_lab" / "needy.py").write_text("import a_simulator_that_is_not_there\n")
    with pytest.raises(sc.UserError, match="importing it fails: ModuleNotFoundError: No module named 'a_sim"):
        sc.make("line_lab.needy:World")
    (package / "line_lab" / "typo.py").write_text("def world(:\n")
    with pytest.raises(sc.UserError, match=r"SyntaxError: .*typo.py, line 1"):
        sc.make("line_lab.typo:World")


def test_what_needs_arguments_is_told_of_config_class(folder):
    (folder / "lines.py").write_text(
        WORLD.replace("config_class = LineConfig", "").replace("presets = {", "p = {")
    )
    with pytest.raises(sc.UserError, match=r"cannot be made without arguments .*config_class"):
        sc.make("lines:LineWorld")


def test_an_installed_package_offers_names(installed):
    assert sc.make("line").n_agents == 2
    assert sc.make("line-world-of-three").n_agents == 3
    assert sc.make("narrow", probes=1).describe() == {"name": "narrow", "probes": 1, "reach": 0.1}
    place = registry.place_of(sc.make("narrow"))
    assert place == "line_lab.worlds:LineWorld", "elsewhere nobody knows the name"
    assert registry.is_offered("line_lab.worlds:LineWorld")
    assert {"line", "narrow", "rover-t2-c1"} < set(registry.names())
    with pytest.raises(sc.UserError, match="probes = 0: give at least 1"):
        sc.make("line", probes=0)


def test_a_folder_that_lies_around_does_not_stand_in_for_an_installed_package(installed, folder):
    write_package(folder)
    (folder / "line_lab" / "worlds.py").write_text("raise SystemExit('it ran what nobody trusted')\n")
    assert sc.make("line").n_agents == 2
    assert sc.make("line_lab.worlds:LineWorld").n_agents == 2


def test_a_file_called_like_another_module_is_told_apart(folder):
    (folder / "json.py").write_text(WORLD)
    env = sc.make("json.py:LineWorld", probes=3)
    assert (env.n_agents, registry.place_of(env)) == (3, f"{folder}/json.py:LineWorld")
    assert type(sc.make("json.py:LineWorld")) is type(env)


def test_one_that_cannot_be_imported_is_named_and_the_others_still_load(installed):
    offered, broken = registry.domains()
    assert [domain.name for domain in offered] == ["rover", "rescue", "warehouse", "line"]
    assert list(broken) == ["licensed"] and "no licence for the simulator" in broken["licensed"]
    with pytest.raises(
        sc.UserError, match=r"unknown environment 'lime'.*first: line.*licensed fails to load"
    ):
        sc.make("lime")
    with pytest.raises(sc.UserError, match="no licence"):
        sc.make("licensed")


def test_what_is_offered_need_not_be_trusted(package):
    assert registry.is_offered("skillcrew.envs.rover.world:RoverDomain")
    assert not registry.is_offered("line_lab.worlds:LineWorld"), "it lies there, and nobody installed it"


def test_a_class_that_borrows_a_known_name_is_told_apart(package):
    env = sc.make("line_lab.worlds:LineWorld")
    env.name = "rover-t2-c1"
    assert registry.place_of(env) == "line_lab.worlds:LineWorld"
    assert registry.place_of(sc.make("rover-t2-c1")) is None
