"""Runs that begin with another run's skills or team: what they begin with, what they remember of it."""

import dataclasses
import shutil
from pathlib import Path

import jax
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import yaml

import skillcrew as sc
from experiment.tiny import (
    OPTIONS,
    SEEDS,
    InterruptAfter,
    assert_same_arrays,
    contents,
    last_arrays,
    tiny_madys,
)
from skillcrew.experiment.checkpoints import Checkpoints
from skillcrew.experiment.config import RunConfig
from skillcrew.experiment.integrity import write_known
from skillcrew.experiment.metrics import read_metrics
from skillcrew.experiment.origin import Origin
from skillcrew.experiment.runner import Runner
from skillcrew.experiment.warm_start import TEAM, Source, prepare

NEW, SHARED = "go_to_poi_C", "go_to_poi_A"


def wider() -> sc.MADyS:
    """The finished run's world with a third type of POIs, and one of its skills."""
    env = sc.make("rover-t3-c2", n_agents=2, episode_length=6, activation_distance=9.0)
    config = dataclasses.replace(tiny_madys().config, skills=(NEW, SHARED))
    return sc.MADyS(env, config)


@pytest.fixture
def only_begins(monkeypatch):
    """Nothing is trained: a run ends with the state that it begins with."""
    monkeypatch.setattr(Runner, "run", lambda self, state: state)


def train(algorithm, out: Path, seeds=SEEDS, reporter=None, **options) -> sc.Run:
    return sc.train(algorithm, seeds, 900.0, out, reporter, **OPTIONS, **options)


def first_weights(run: Path, index: int, network: str) -> np.ndarray:
    """[seeds, ..., inputs, units] of one skill."""
    return last_arrays(run)[0][f".algorithm.skills.learners.{network}.network.weights[0]"][:, index]


def assert_same(these, those) -> None:
    jax.tree.map(np.testing.assert_array_equal, these, those)


def steps_of(folder: Path) -> int:
    return int(read_metrics(folder / "metrics.parquet")["environment_steps"].max())


def test_skills_begin_as_they_were_and_the_configuration_says_whose(finished, only_begins, tmp_path) -> None:
    notes = InterruptAfter(0, None)
    run = train(wider(), tmp_path / "run", reporter=notes, skills_from=finished, skills_frozen=True)
    # A channel for the new type stands at the end of each sector; critics see the action behind it all.
    new = np.append(np.arange(16) % 4 == 3, [False, False])
    for network, inputs in (("target_actor", 16), ("actor", 16), ("critics", 18), ("target_critics", 18)):
        ours = first_weights(run.folder.path, 1, network)
        np.testing.assert_array_equal(ours[..., ~new[:inputs], :], first_weights(finished, 0, network))
        assert not ours[..., new[:inputs], :].any()
    assert f"From {finished}: {SHARED}; at random: {NEW}." in notes.notes

    origin = sc.Run(run.folder.path).config.skills_from
    checkpoint = max(Checkpoints(finished / "checkpoints").generations())
    assert origin == Origin(str(finished), checkpoint, origin.digest, steps_of(finished))
    cost = f"which had cost {steps_of(finished)} steps per seed that are not counted here"
    said = f"{cost}; these skills learn no more"
    assert run.config.origins() == [f"began with skills of {finished} (generation {checkpoint}), {said}"]
    stopped = last_arrays(run.folder.path)[0][".algorithm.skills.plateau.stopped_at"]
    np.testing.assert_array_equal(stopped, [[-1, 0]] * 2)


def test_it_goes_on_without_the_other_run(finished, only_begins, tmp_path) -> None:
    source = shutil.copytree(finished, tmp_path / "source")
    run = train(wider(), tmp_path / "run", skills_from=source).folder.path
    begun = last_arrays(run)[0]
    shutil.rmtree(source)
    notes = InterruptAfter(0, None)
    sc.Run(run).resume(reporter=notes)
    assert notes.notes == ["Goes on from generation 0."]
    assert_same_arrays(last_arrays(run)[0], begun)
    # Killed before its first checkpoint, it needs the other one, and says which.
    shutil.rmtree(run / "checkpoints")
    with pytest.raises(sc.UserError, match=f"skills_from = {source}: {source}: no such run folder"):
        sc.Run(run).resume()


def test_skills_and_team_are_trained_on_from_where_they_were(finished, tmp_path) -> None:
    run = train(tiny_madys(), tmp_path / "run", skills_from=finished, team_from=finished)
    assert run.metrics()["generation"].max() == 12
    assert run.metrics()["environment_steps"].min() < 200
    (said,) = run.config.origins()
    assert said.startswith(f"began with skills and team of {finished} (generation 12), which had cost")
    # And what begins with that had cost both.
    source = Source(Origin(str(run.folder.path)), trust=False, note=print)
    assert source.origin.steps == steps_of(run.folder.path) + steps_of(finished)


def test_each_seed_has_the_champion_of_its_own(finished, only_begins, tmp_path) -> None:
    notes = InterruptAfter(0, None)
    run = train(tiny_madys(), tmp_path / "run", reporter=notes, team_from=finished)
    for seed in SEEDS:
        assert_same(run.champion(seed).selectors, sc.Run(finished).champion(seed).selectors)
    assert any("begins with random skills" in note for note in notes.notes)


@pytest.mark.parametrize("best", SEEDS)
def test_other_numbers_of_seeds_have_the_best_ones(finished, copied, best) -> None:
    columns = read_metrics(copied / "metrics.parquet")
    score = np.where(columns["seed"] == best, 0.75, 0.5)
    table = {**columns, "success_rate": score}
    write_metrics(copied / "metrics.parquet", table)
    teams = Source(Origin(str(copied)), trust=False, note=print).part(TEAM, seeds=3)
    expected = sc.Run(finished).champion(best)
    for place in range(3):
        assert_same(jax.tree.map(lambda leaf, at=place: leaf[at], teams), expected)


def write_metrics(path: Path, columns) -> None:
    write_known(path, lambda temporary: pq.write_table(pa.table(columns), temporary))


def test_the_configuration_fed_back_begins_with_the_same(finished, copied, only_begins, tmp_path) -> None:
    first = train(wider(), tmp_path / "first", skills_from=copied)
    origin = first.config.skills_from
    config = RunConfig(seeds=SEEDS, skills_from=origin)
    again, begin = prepare(wider(), config, trust=False, note=print)
    assert begin is not None and again == config
    shutil.rmtree(copied / "checkpoints" / str(origin.checkpoint))
    with pytest.raises(sc.UserError, match=r"no checkpoint 12; there are 10"):
        prepare(wider(), config, trust=False, note=print)
    other = RunConfig(seeds=SEEDS, skills_from=dataclasses.replace(origin, checkpoint=10))
    with pytest.raises(sc.UserError, match="its checkpoint 10 is another one than this configuration knows"):
        prepare(wider(), other, trust=False, note=print)


def no_checkpoint(run: Path) -> None:
    shutil.rmtree(run / "checkpoints")


def nobody_knows_its_world(run: Path) -> None:
    config = yaml.safe_load((run / "config.yaml").read_text())
    config["environment"] = {"name": "mine", "class": "mylab.worlds:Mine"}
    write_known(run / "config.yaml", lambda path: path.write_text(yaml.safe_dump(config)))


def no_selectors(run: Path) -> None:
    config = yaml.safe_load((run / "config.yaml").read_text())
    config["algorithm"] = {"name": "ea"}
    write_known(run / "config.yaml", lambda path: path.write_text(yaml.safe_dump(config)))


@pytest.mark.parametrize("field", ["skills_from", "team_from"])
@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (no_checkpoint, "it has no finished checkpoint yet; wait for the first, or resume it"),
        (nobody_knows_its_world, "imported only if you trust this folder: give --trust"),
        (no_selectors, "belongs to another configuration"),
        (lambda run: shutil.rmtree(run), "no such run folder"),
    ],
    ids=["no checkpoint", "untrusted", "another algorithm", "no folder"],
)
def test_a_run_that_cannot_be_begun_with_leaves_nothing(copied, tmp_path, damage, said, field) -> None:
    damage(copied)
    before = contents(tmp_path)
    with pytest.raises(sc.UserError) as refused:
        train(tiny_madys(), tmp_path / "new", **{field: copied})
    message = str(refused.value)
    assert message.startswith(f"{field} = {copied}: ") and said in message and "\n" not in message
    assert contents(tmp_path) == before


def test_frozen_skills_have_to_come_from_somewhere() -> None:
    with pytest.raises(sc.UserError, match="skills_frozen = True: no skills are taken over"):
        train(tiny_madys(), Path("nowhere"), skills_frozen=True)
    with pytest.raises(sc.UserError, match="a run to begin with has no name"):
        train(tiny_madys(), Path("nowhere"), skills_from="")
