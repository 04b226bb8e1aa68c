"""Files are believed only as they were written."""

import json
import os
import shutil

import numpy as np
import pytest

import skillcrew as sc
from experiment.tiny import contents
from skillcrew.experiment.integrity import check_known, damage, seal, write_known


def known_file(tmp_path, *texts):
    path = tmp_path / "notes.txt"
    for text in texts:
        write_known(path, lambda temporary, text=text: temporary.write_text(text))
    return path


def test_a_sealed_folder_is_whole_until_a_bit_of_it_changes(tmp_path):
    (tmp_path / "below").mkdir()
    (tmp_path / "one").write_bytes(b"abc")
    (tmp_path / "below" / "two").write_bytes(b"defg")
    assert damage(tmp_path) == "was never finished"
    seal(tmp_path)
    assert damage(tmp_path) is None
    (tmp_path / "below" / "two").write_bytes(b"deff")
    assert damage(tmp_path) == "below/two is damaged"
    (tmp_path / "below" / "two").unlink()
    assert damage(tmp_path) == "below/two is missing"


@pytest.mark.parametrize("text", ["", "[]", '{"one": "abc"}', '{"one": [1]}', "\0\0", "[" * 100_000])
def test_digests_that_cannot_be_read_are_damage(tmp_path, text):
    (tmp_path / "one").write_bytes(b"abc")
    seal(tmp_path)
    (tmp_path / "digests.json").write_text(text)
    assert damage(tmp_path) == "digests.json is damaged"
    with pytest.raises(sc.UserError, match=r"digests.json: damaged; delete it"):
        check_known(tmp_path / "one", "restore it")


def test_a_file_is_known_as_it_was_written_last(tmp_path):
    path = known_file(tmp_path, "first", "second")
    check_known(path, "restore it")
    path.write_text("third")
    with pytest.raises(sc.UserError, match=r"notes.txt: damaged, or changed since .*; restore it, or delete"):
        check_known(path, "restore it")
    (tmp_path / "digests.json").unlink()
    check_known(path, "restore it")


def test_a_kill_between_the_digest_and_the_file_leaves_a_known_file(tmp_path):
    path = known_file(tmp_path, "first", "second")
    path.write_text("first")
    check_known(path, "restore it")
    known_file(tmp_path, "third")
    path.write_text("first")
    with pytest.raises(sc.UserError, match="damaged"):
        check_known(path, "restore it")


def test_files_side_by_side_are_known_apart(tmp_path):
    path = known_file(tmp_path, "first")
    other = tmp_path / "other.txt"
    write_known(other, lambda temporary: temporary.write_text("else"))
    check_known(path, "restore it")
    path.write_text("else")
    with pytest.raises(sc.UserError, match=r"notes\.txt"):
        check_known(path, "restore it")
    check_known(other, "restore it")


def test_a_file_that_cannot_be_read_is_damaged(tmp_path, monkeypatch):
    path = known_file(tmp_path, "first")

    def unreadable(*_):
        raise OSError(5, "Input/output error")

    monkeypatch.setattr("hashlib.file_digest", unreadable)
    assert damage(tmp_path) == "notes.txt is damaged"
    with pytest.raises(sc.UserError, match="damaged, or changed"):
        check_known(path, "restore it")


@pytest.mark.parametrize("name", ["x" * 300, "a\nb", "\0", "/dev/zero", "../notes.txt/x"])
def test_digests_of_files_that_cannot_be_are_of_missing_ones(name, tmp_path):
    (tmp_path / "digests.json").write_text(json.dumps({name: ["x"]}))
    assert damage(tmp_path) == f"{name} is missing"


def test_digests_that_are_a_pipe_are_not_waited_for(tmp_path):
    path = known_file(tmp_path, "first")
    (tmp_path / "digests.json").unlink()
    os.mkfifo(tmp_path / "digests.json")
    with pytest.raises(sc.UserError, match=r"digests.json: damaged"):
        check_known(path, "restore it")


def test_a_file_that_nothing_is_known_of_passes(tmp_path):
    (tmp_path / "stranger").write_text("abc")
    check_known(tmp_path / "stranger", "restore it")
    known_file(tmp_path, "first")
    check_known(tmp_path / "stranger", "restore it")
    check_known(tmp_path / "absent", "restore it")


@pytest.mark.parametrize("name", ["config.yaml", "metrics.parquet"])
def test_any_damage_to_what_a_run_folder_says_is_one_line(copied, name):
    path = copied / name
    intact, dice = path.read_bytes(), np.random.default_rng(0)
    for _ in range(5):
        place = int(dice.integers(len(intact)))
        flipped = bytes([intact[place] ^ (1 << int(dice.integers(8)))])
        for damaged in (intact[:place] + flipped + intact[place + 1 :], intact[:place], b""):
            path.write_bytes(damaged)
            before = contents(copied)
            with pytest.raises(sc.UserError, match=rf"{name}: damaged, or changed") as caught:
                sc.Run(copied).resume()
            assert "\n" not in str(caught.value)
            assert contents(copied) == before


def test_a_configuration_that_is_changed_on_purpose_is_taken_once_its_digest_is_gone(copied):
    config = copied / "config.yaml"
    config.write_text(config.read_text().replace("score_episodes: 3", "score_episodes: 4"))
    with pytest.raises(sc.UserError, match=r"delete .*digests\.json"):
        sc.Run(copied)
    (copied / "digests.json").unlink()
    sc.Run(copied)


def test_a_moved_folder_is_still_whole(copied, tmp_path):
    moved = shutil.copytree(copied, tmp_path / "elsewhere" / "run")
    assert set(json.loads((moved / "digests.json").read_text())) == {"config.yaml", "metrics.parquet"}
    sc.Run(moved).metrics()
    assert sc.Run(moved).champions() is not None
