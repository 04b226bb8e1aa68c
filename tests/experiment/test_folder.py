"""A run folder is whole or not there, and trouble with the disk is one line."""

import errno
import os
import resource
import shutil
import stat
import subprocess

import jax
import pytest

import skillcrew as sc
from experiment.tiny import OPTIONS, InterruptAfter, contents
from skillcrew.cli.main import run_command
from skillcrew.experiment import folder
from skillcrew.experiment.files import write_whole
from skillcrew.experiment.folder import RunFolder
from skillcrew.experiment.metrics import read_metrics


def full(*_, **__):
    raise OSError(errno.ENOSPC, "No space left on device")


def test_a_folder_explains_itself(finished):
    assert {"config.yaml", "metrics.parquet", "timing.json", "environment.txt", "README.txt"} <= {
        path.name for path in finished.iterdir()
    }
    environment = (finished / "environment.txt").read_text()
    for part in ("skillcrew ", "jax ", "python ", "device ", "command "):
        assert f"\n{part}" in "\n" + environment
    explained = (finished / "README.txt").read_text()
    for path in finished.iterdir():
        assert path.name in explained or path.name == "README.txt"
    assert not [path for path in finished.iterdir() if path.name.startswith(".")]


def test_the_commit_is_named_where_the_code_is_of_a_checkout(tmp_path, monkeypatch):
    def git(*words: str) -> str:
        named = ["git", "-C", str(tmp_path), "-c", "user.name=n", "-c", "user.email=e", *words]
        return subprocess.run(named, capture_output=True, text=True, check=True).stdout.strip()

    package = tmp_path / "src" / "package"
    (package / "rooms").mkdir(parents=True)
    monkeypatch.setattr(folder, "__file__", str(package / "rooms" / "folder.py"))
    commits = [describe_commit()]
    (package / "__init__.py").write_text("")
    git("init", "--quiet")
    commits.append(describe_commit())
    git("add", ".")
    git("commit", "--quiet", "--message", "all")
    commits.append(describe_commit())
    (tmp_path / "notes.txt").write_text("of no matter")
    commits.append(describe_commit())
    (package / "__init__.py").write_text("changed")
    commits.append(describe_commit())
    sha = git("rev-parse", "HEAD")
    # No checkout, a checkout of something else, as committed, beside other files, and changed.
    assert commits == ["", "", sha, sha, f"{sha} with changes"]


def describe_commit() -> str:
    lines = folder.describe_environment().splitlines()
    return next((line.removeprefix("commit ") for line in lines if line.startswith("commit ")), "")


def test_files_can_be_read_by_others(finished):
    for name in ("config.yaml", "metrics.parquet"):
        assert (finished / name).stat().st_mode & stat.S_IROTH


@pytest.mark.parametrize("kind", ["run", "folder", "file"])
def test_what_exists_is_refused_and_untouched(kind, copied, tmp_path, counting):
    place = copied if kind == "run" else tmp_path / "other"
    if kind == "folder":
        place.mkdir()
        (place / "thesis.tex").write_text("years of work")
    elif kind == "file":
        place.write_text("years of work")
    before = contents(tmp_path)
    with pytest.raises(sc.UserError, match=r"exists and is never overwritten.*--out") as caught:
        sc.train(counting, out=place, steps=50.0)
    assert "\n" not in str(caught.value)
    assert contents(tmp_path) == before


def test_below_a_file_nothing_can_be_made(tmp_path, counting):
    (tmp_path / "file").write_text("")
    with pytest.raises(sc.UserError, match="cannot be written, not a directory") as caught:
        sc.train(counting, out=tmp_path / "file" / "run", steps=50.0)
    assert str(tmp_path / "file" / "run") in str(caught.value)


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_read_only_parent(tmp_path, counting):
    tmp_path.chmod(0o500)
    with pytest.raises(sc.UserError, match=r"you may not write there.*--out"):
        sc.train(counting, out=tmp_path / "run", steps=50.0)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("code", [errno.EACCES, errno.EROFS])
def test_a_refusal_by_the_system_is_one_line(code, tmp_path, monkeypatch):
    def refuse(*_, **__):
        raise OSError(code, os.strerror(code))

    monkeypatch.setattr("tempfile.mkstemp", refuse)
    with pytest.raises(sc.UserError, match=r"you may not write there; .*--out") as caught:
        RunFolder(tmp_path / "run").create("text")
    assert "\n" not in str(caught.value)
    assert not list(tmp_path.iterdir())


def test_a_disk_that_is_full_from_the_start_leaves_no_folder(tmp_path, monkeypatch, counting):
    monkeypatch.setattr("pathlib.Path.write_text", full)
    with pytest.raises(sc.UserError, match="the disk is full"):
        sc.train(counting, out=tmp_path / "deep" / "run", steps=50.0)
    assert not (tmp_path / "deep" / "run").exists()


def test_a_file_is_written_whole_or_stays_as_it_was(tmp_path):
    path = tmp_path / "file"
    write_whole(path, lambda temporary: temporary.write_text("old"))

    def half(temporary):
        temporary.write_text("ne")
        full()

    with pytest.raises(sc.UserError, match=r"file: cannot be written, the disk is full"):
        write_whole(path, half)
    with pytest.raises(ZeroDivisionError):  # Not trouble with the disk: somebody's bug, shown as such.
        write_whole(path, lambda temporary: 1 / 0)
    assert contents(tmp_path) == {"file": b"old"}


def test_a_disk_without_room_for_a_checkpoint_is_said_before_compiling(tmp_path, monkeypatch, counting):
    usage = shutil.disk_usage(tmp_path)._replace(free=11)
    monkeypatch.setattr("shutil.disk_usage", lambda _: usage)
    monkeypatch.setattr("skillcrew.experiment.generation.CompiledChunk", lambda *_: pytest.fail("compiled"))
    with pytest.raises(sc.UserError, match="the disk is full"):
        sc.train(counting, 2, 200.0, tmp_path / "run", **OPTIONS)


def test_a_disk_that_fills_up_leaves_what_was_saved(tmp_path, monkeypatch, counting):
    run = tmp_path / "run"
    with monkeypatch.context() as disk, pytest.raises(sc.UserError) as caught:
        reporter = InterruptAfter(2, lambda: disk.setattr("pyarrow.parquet.write_table", full))
        sc.train(counting, 2, 200.0, run, reporter, **OPTIONS)
    assert "the disk is full" in str(caught.value) and "skillcrew resume" in str(caught.value)
    assert read_metrics(run / "metrics.parquet")["generation"].max() == 2
    resumed = sc.Run(run, counting.env).resume()
    assert resumed.metrics()["environment_steps"][-1] >= 200


@pytest.fixture
def limit_file_sizes():
    """Sets a limit in bytes for the rest of the test, in which compiled programs are not written."""
    before, seldom = resource.getrlimit(resource.RLIMIT_FSIZE), "jax_persistent_cache_min_compile_time_secs"

    def limit(size):
        jax.config.update(seldom, 1e9)
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))

    yield limit
    resource.setrlimit(resource.RLIMIT_FSIZE, before)
    jax.config.update(seldom, 0.0)


def test_a_limit_on_file_sizes_is_one_line_and_exit_code_2(limit_file_sizes, counting, tmp_path, capsys):
    run = sc.train(counting, 2, 100.0, tmp_path / "run", **OPTIONS).folder.path
    latest = sorted((run / "checkpoints").iterdir(), key=lambda path: int(path.name))
    for path in latest[1:]:  # So that there is something to do.
        shutil.rmtree(path)
    before = contents(run)
    limit = len(before["metrics.parquet"]) // 2
    assert len(before["config.yaml"]) < limit
    limit_file_sizes(limit)
    assert run_command(["resume", str(run), "--trust"]) == 2
    output, errors = capsys.readouterr()
    assert output == ""
    assert errors.splitlines()[-1].startswith("skillcrew: ") and "the disk is full" in errors
    assert "Traceback" not in errors
    after = contents(run)
    assert {name: after[name] for name in before if name != "timing.json"} == {
        name: before[name] for name in before if name != "timing.json"
    }
    assert set(after) == set(before)


def test_what_is_no_run(tmp_path):
    with pytest.raises(sc.UserError, match="no such run folder"):
        sc.Run(tmp_path / "none")
    with pytest.raises(sc.UserError, match=r"not a run folder.*config\.yaml"):
        sc.Run(tmp_path)
    (tmp_path / "file").write_text("")
    with pytest.raises(sc.UserError, match="run folder"):
        sc.Run(tmp_path / "file")


@pytest.mark.parametrize("name", ["checkpoints", "report"])
def test_nothing_is_written_where_a_link_leads(name, copied, tmp_path):
    elsewhere = tmp_path / "elsewhere"
    if (copied / name).exists():
        shutil.move(copied / name, elsewhere)
    else:
        elsewhere.mkdir()
    (copied / name).symlink_to(elsewhere)
    before = contents(elsewhere)
    with pytest.raises(sc.UserError, match=f"{name}: a link, and what it leads to would be changed"):
        sc.Run(copied).resume(steps=1200)
    assert contents(elsewhere) == before


@pytest.mark.parametrize("name", ["report", "checkpoints"])
def test_what_is_no_folder_and_stands_in_the_place_of_one_is_named(name, tmp_path):
    (tmp_path / name).write_text("not a folder")
    with pytest.raises(sc.UserError, match=f"{name}: stands where a folder is to be; move it away"):
        RunFolder(tmp_path).check_own()
