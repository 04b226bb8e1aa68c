"""Checkpoints hold everything, and damage of any kind is one line that changes nothing."""

import json
import logging
import shutil
import subprocess
import sys

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import skillcrew as sc
from experiment.tiny import (
    SEEDS,
    InterruptAfter,
    assert_same_arrays,
    assert_same_ending,
    contents,
    last_arrays,
    tiny_madys,
)
from skillcrew.errors import Notice
from skillcrew.experiment.checkpoints import FORMAT, Checkpoints
from skillcrew.experiment.generation import flat_arrays, from_flat_arrays, shapes
from skillcrew.experiment.integrity import seal
from skillcrew.experiment.metrics import read_metrics

LIKE = {"value": jnp.zeros(3)}


def save_some(folder, rates, keep=2):
    checkpoints = Checkpoints(folder, keep)
    for generation, rate in enumerate(rates, start=1):
        checkpoints.save(generation, {"value": jnp.full(3, float(generation))}, rate)
    return checkpoints


def latest(run):
    return max((run / "checkpoints").iterdir(), key=lambda path: int(path.name))


def test_the_last_ones_and_the_best_are_kept(tmp_path):
    checkpoints = save_some(tmp_path / "c", [0.1, 0.9, 0.2, 0.3, 0.1])
    assert checkpoints.generations() == [2, 4, 5]
    assert checkpoints.read(LIKE, 2)[0]["['value']"].tolist() == [2, 2, 2]
    assert checkpoints.read(LIKE)[0]["['value']"].tolist() == [5, 5, 5]
    with pytest.raises(sc.UserError, match="no checkpoint 3; there are 2, 4, 5"):
        checkpoints.read(LIKE, 3)


def test_of_equals_the_later_one_is_the_best(tmp_path):
    assert save_some(tmp_path / "c", [0.5, 0.5, 0.1, 0.1], keep=1).generations() == [2, 4]


def test_a_damaged_one_is_not_the_best_and_no_reason_not_to_save(tmp_path):
    checkpoints = save_some(tmp_path / "c", [0.9, 0.5, 0.1], keep=2)
    (tmp_path / "c" / "1" / "about.json").write_text("}{")
    checkpoints.save(4, LIKE, 0.2)
    checkpoints.save(5, LIKE, 0.3)
    assert checkpoints.generations() == [2, 4, 5]


def test_the_best_may_be_among_the_last_ones(tmp_path):
    assert save_some(tmp_path / "c", [0.1, 0.2, 0.3, 0.9], keep=3).generations() == [2, 3, 4]


def test_everything_that_a_run_goes_on_from_is_held(finished):
    run = sc.Run(finished)
    like = shapes(run.algorithm, run.config)
    (arrays,) = last_arrays(finished)
    expected = jax.eval_shape(flat_arrays, like)
    assert {name: (a.shape, a.dtype) for name, a in arrays.items()} == {
        name: (leaf.shape, leaf.dtype) for name, leaf in expected.items()
    }
    parts = (".algorithm.key", ".score_key", ".team", "genomes", "lineage.mean", "lineage.evaluations")
    parts += ("actor_optimiser", "critic_optimiser", "target_actor", "target_critics", "experience")
    for part in (*parts, "current_index", "is_full", "stopped_at", "waited", "environment_steps"):
        assert any(part in name for name in arrays), part
    # Held and not merely named: two seeds of a run that has learned differ in all that is random.
    for name, array in arrays.items():
        if any(part in name for part in ("key", "genomes", "critic", "experience.experience")):
            floats = array.dtype.kind == "f" and "bias" not in name
            assert not floats or (array[0] != array[1]).any(), name
    state = from_flat_arrays(arrays, like)
    assert jax.tree.structure(state) == jax.tree.structure(like)
    assert jax.dtypes.issubdtype(state.score_key.dtype, jax.dtypes.prng_key)
    assert_same_arrays({name: np.asarray(leaf) for name, leaf in flat_arrays(state).items()}, arrays)


def test_what_is_read_is_what_was_written_with_nan_infinity_and_every_type(tmp_path):
    state = {
        "key": jax.random.split(jax.random.key(1), 2),
        "float": jnp.asarray([[jnp.nan, -jnp.inf, 1e-38]]),
        "int": jnp.asarray([-1, 2**31 - 1]),
        "bool": jnp.asarray([True, False]),
        "scalar": jnp.asarray(3, jnp.uint32),
    }
    checkpoints = Checkpoints(tmp_path / "c")
    checkpoints.save(7, state, 0.5)
    arrays, has_buffer = checkpoints.read(state)
    assert has_buffer
    written = {name: np.asarray(leaf) for name, leaf in flat_arrays(state).items()}
    assert_same_arrays({name: np.asarray(arrays[name]) for name in written}, written)


def damages(intact, dice):
    """What can become of a file: a flipped bit, cut off, its tail zeroed, emptied, deleted (None)."""
    place = int(dice.integers(len(intact)))
    flipped = intact[place] ^ (1 << int(dice.integers(8)))
    yield intact[:place] + bytes([flipped]) + intact[place + 1 :]
    yield intact[:place]
    yield intact[:place] + bytes(len(intact) - place)
    yield b""
    yield None


def test_any_damage_to_any_file_is_noticed_and_the_checkpoint_before_is_used(copied):
    dice = np.random.default_rng(0)
    place, checkpoints = latest(copied), Checkpoints(copied / "checkpoints")
    before, last = checkpoints.generations()[-2:]
    files = [path for path in sorted(place.rglob("*")) if path.is_file() and path.stat().st_size]
    assert {"about.json", "digests.json"} < {path.name for path in files}
    assert len(files) >= 6
    for path in files:
        intact = path.read_bytes()
        for damaged in damages(intact, dice):
            if damaged == intact:
                continue
            path.unlink() if damaged is None else path.write_bytes(damaged)
            generation, lines = checkpoints.choose()
            assert generation == before, path
            assert len(lines) == 1, path
            assert lines[0].startswith(str(place)), path
            with pytest.raises(sc.UserError, match=f"--checkpoint .*{before}") as caught:
                checkpoints.choose(last)
            assert "\n" not in str(caught.value)
            path.write_bytes(intact)
    assert checkpoints.choose() == (last, [])


def test_a_champion_of_the_checkpoint_before_is_announced(copied, finished):
    whole = sc.Run(finished, checkpoint=Checkpoints(finished / "checkpoints").generations()[-2])
    (latest(copied) / "about.json").unlink()
    with pytest.warns(Notice, match=r"about.json is missing; checkpoint \d+ is used instead"):
        champions = sc.Run(copied).champions()
    jax.tree.map(np.testing.assert_array_equal, champions, whole.champions())


def test_a_run_goes_on_from_the_checkpoint_before_and_ends_the_same(copied, finished):
    next((latest(copied) / "state").glob("**/d/*")).write_bytes(b"gone")
    reporter = InterruptAfter(10**9, None)
    sc.Run(copied).resume(reporter=reporter)
    assert any("is used instead" in note for note in reporter.notes)
    assert_same_ending(copied, finished)


def test_where_all_are_damaged_there_is_nothing_to_go_on_from(copied):
    for place in (copied / "checkpoints").iterdir():
        shutil.rmtree(place / "state")
    before = contents(copied)
    with pytest.raises(sc.UserError, match="is missing, and there is no other") as caught:
        sc.Run(copied).resume()
    assert "\n" not in str(caught.value)
    assert contents(copied) == before


def test_damage_leaves_the_configuration_as_it_was_even_if_the_budget_was_to_change(copied):
    for place in (copied / "checkpoints").iterdir():
        shutil.rmtree(place / "state")
    before = contents(copied)
    with pytest.raises(sc.UserError, match="is missing"):
        sc.Run(copied).resume(steps=1e6)
    assert contents(copied) == before


@pytest.mark.parametrize(
    ("change", "said"), [(1, r"newer skillcrew.*upgrade"), (-1, r"older skillcrew.*anew")]
)
def test_a_checkpoint_of_another_format_is_refused(change, said, copied):
    about = latest(copied) / "about.json"
    text = json.loads(about.read_text())
    assert text["format"] == FORMAT
    about.write_text(json.dumps({**text, "format": FORMAT + change}))
    seal(latest(copied))
    before = contents(copied)
    with pytest.raises(sc.UserError, match=said):
        sc.Run(copied).resume()
    assert contents(copied) == before


def test_a_checkpoint_from_before_there_were_digests_is_an_older_one(copied):
    place = latest(copied)
    for name in ("about.json", "digests.json"):
        (place / name).unlink()
    (place / "about").mkdir()
    (place / "about" / "metadata").write_text('{"format": 3}')
    with pytest.raises(sc.UserError, match=r"older skillcrew .*format 3.*anew"):
        sc.Run(copied).resume()


@pytest.mark.parametrize(
    ("old", "new"), [("population: 7", "population: 9"), ("  - 3\n", ""), ("pois_per_type: 1", "n_agents: 3")]
)
def test_a_checkpoint_of_another_configuration_is_refused(old, new, copied):
    config = copied / "config.yaml"
    text = config.read_text()
    if new == "n_agents: 3":
        old = "n_agents: 2"
    assert old in text
    config.write_text(text.replace(old, new))
    (copied / "digests.json").unlink()
    before = contents(copied)
    with pytest.raises(sc.UserError, match=r"another configuration.*config\.yaml") as caught:
        sc.Run(copied).resume()
    assert "\n" not in str(caught.value)
    assert contents(copied) == before


def test_a_foreign_folder_among_the_checkpoints_is_no_checkpoint(copied):
    foreign = copied / "checkpoints" / "999"
    foreign.mkdir()
    (foreign / "holiday.txt").write_text("sun")
    checkpoints = Checkpoints(copied / "checkpoints")
    generation, lines = checkpoints.choose()
    assert generation == checkpoints.generations()[-2]
    assert lines == [f"{foreign}: was never finished"]
    with pytest.raises(sc.UserError, match=r"999: was never finished; use another"):
        sc.Run(copied, checkpoint=999).resume()


def test_what_stands_in_the_place_of_a_checkpoint_goes_and_what_a_link_leads_to_stays(tmp_path):
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "letter.txt").write_text("Dear reader")
    checkpoints = save_some(tmp_path / "c", [0.1])
    (tmp_path / "c" / "8").write_text("a file")
    for name in ("9", ".unfinished-9"):
        (tmp_path / "c" / name).symlink_to(elsewhere)
    assert checkpoints.choose()[0] == 1
    checkpoints.discard_after(1)
    assert checkpoints.generations() == [1]
    checkpoints.save(2, LIKE, 0.2)
    assert sorted(path.name for path in (tmp_path / "c").iterdir()) == ["1", "2"]
    assert (elsewhere / "letter.txt").read_text() == "Dear reader"


@pytest.mark.parametrize("name", ["007", "٣", "9" * 200 + "x", "-1"])
def test_a_folder_that_is_not_called_like_a_generation_is_no_checkpoint(name, tmp_path):
    checkpoints = save_some(tmp_path / "c", [0.1])
    (tmp_path / "c" / name).mkdir()
    assert checkpoints.generations() == [1]
    checkpoints.discard_after(1)
    assert (tmp_path / "c" / name).exists()


@pytest.mark.parametrize(
    "about", ['{"format": 4}', '{"format": 4, "buffer": 5}', '{"format": 4, "buffer": true, "score": 1%s}']
)
def test_what_a_checkpoint_says_of_itself_is_looked_at(about, tmp_path):
    checkpoints = save_some(tmp_path / "c", [0.1, 0.2])
    about = about.replace("%s", "0" * 400)
    (tmp_path / "c" / "2" / "about.json").write_text(about)
    seal(tmp_path / "c" / "2")
    generation, lines = checkpoints.choose()
    assert (generation, len(lines)) == ((2, 0) if "true" in about else (1, 1))
    # No score that can be compared is none.
    checkpoints.save(3, LIKE, 0.1)
    checkpoints.save(4, LIKE, 0.1)


def test_leftovers_of_a_kill_are_ignored_and_then_cleaned(copied, finished):
    unfinished = copied / "checkpoints" / ".unfinished-999"
    shutil.copytree(latest(copied), unfinished)
    assert_same_arrays(*last_arrays(copied, finished))
    checkpoints = Checkpoints(copied / "checkpoints")
    assert 999 not in checkpoints.generations()
    checkpoints.save(1000, LIKE, 0.0)
    assert not unfinished.exists()


def test_an_error_while_saving_leaves_the_earlier_ones(tmp_path, monkeypatch):
    checkpoints = save_some(tmp_path / "c", [0.1])
    before = contents(tmp_path / "c" / "1")

    def full(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("orbax.checkpoint.Checkpointer.save", full)
    with pytest.raises(sc.UserError, match=r"the disk is full.*resume") as caught:
        checkpoints.save(2, LIKE, 0.2)
    assert "\n" not in str(caught.value)
    assert checkpoints.generations() == [1]
    assert contents(tmp_path / "c" / "1") == before


def test_a_disk_without_room_is_said_before_anything_is_written(tmp_path, monkeypatch):
    checkpoints = save_some(tmp_path / "c", [0.1])
    before = contents(tmp_path)
    usage = shutil.disk_usage(tmp_path)._replace(free=11)
    monkeypatch.setattr("shutil.disk_usage", lambda _: usage)
    with pytest.raises(sc.UserError, match="the disk is full"):
        checkpoints.save(2, LIKE, 0.2)  # 12 bytes
    assert contents(tmp_path) == before


def test_a_really_full_disk_is_one_line(tmp_path, capfd):
    place = tmp_path / "disk"
    place.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=256k", "tmpfs", str(place)]
    if sys.platform != "linux" or subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("needs the right to mount a small file system")
    try:
        checkpoints = save_some(place / "c", [0.1])
        noise = {"value": jax.random.normal(jax.random.key(0), (200_000,))}
        with pytest.raises(sc.UserError, match=r"the disk is full: 0.8 MiB.* resume") as caught:
            checkpoints.save(2, noise, 0.2)
        assert "\n" not in str(caught.value)
        # Nothing from the threads of the storage library either, and nothing half-written.
        assert capfd.readouterr().err == ""
        assert [path.name for path in (place / "c").iterdir()] == ["1"]
        assert checkpoints.read(LIKE)[0]["['value']"].tolist() == [1, 1, 1]
    finally:
        subprocess.run(["umount", "-l", str(place)], check=True)


def test_a_run_keeps_two_checkpoints_and_perhaps_a_better_one(finished):
    metrics = read_metrics(finished / "metrics.parquet")
    last = metrics["generation"].max()
    kept = Checkpoints(finished / "checkpoints").generations()
    assert kept[-2:] == [last - 2, last]
    # A checkpoint's rate is the mean over its chunk (two generations) and seeds.
    rates = {
        int(g): metrics["success_rate"][np.isin(metrics["generation"], (g - 1, g))].mean()
        for g in range(2, last + 1, 2)
    }
    assert max(rates.values()) == pytest.approx(max(rates[g] for g in kept))
    assert len(kept) <= 3


def test_no_checkpoint_at_all(copied):
    shutil.rmtree(copied / "checkpoints")
    with pytest.raises(sc.UserError, match="no finished checkpoint"):
        sc.Run(copied).champion(SEEDS[0])


def test_saving_does_not_speak_through_the_root_logger(tmp_path, caplog):
    with caplog.at_level(logging.INFO):
        save_some(tmp_path / "c", [0.1])
    assert not [record for record in caplog.records if record.levelno >= logging.WARNING]


def test_another_algorithm_size_in_code_is_not_confused_with_the_folder(finished):
    other = tiny_madys(population=9)
    with pytest.raises(sc.UserError, match="another configuration"):
        Checkpoints(finished / "checkpoints").read(shapes(other, sc.Run(finished).config))
