"""What runs JaxMARL's IPPO on our task: which environments it gets, what is refused, who does not learn."""

import subprocess

import jax
import pytest

pytest.importorskip("jaxmarl")

import jaxmarl
from benchmarks import jaxmarl_baseline
from benchmarks.checkout import commit
from benchmarks.jaxmarl_agents import TOLD, score

EPISODES = 200
CLOSE_TO_A = {"skills": ("go_to_poi_A",)}
BASELINE = "import jaxmarl\n\ndef make_train(name, **own):\n    return jaxmarl.make(name, **own)\n"


def scores(act: str) -> tuple[float, float]:
    """Return of an agent that does not learn, and the share of episodes that it finishes."""
    env = jaxmarl_baseline.make("rover-t2-c1", **CLOSE_TO_A)
    returned, finished = score(env, TOLD[act], jax.random.key(1), EPISODES)
    return float(returned), float(finished)


def checkout(folder):
    """A repository with a baseline in it."""
    file = folder / jaxmarl_baseline.IPPO
    file.parent.mkdir(parents=True)
    file.write_text(BASELINE)
    author = ["-c", "user.name=a", "-c", "user.email=a@b"]
    for command in (["init", "-q"], ["add", "."], [*author, "commit", "-q", "-m", "first"]):
        subprocess.run(["git", *command], cwd=folder, check=True)
    return file


def test_who_goes_straight_to_both_finishes_and_who_stays_is_paid_more() -> None:
    """The dense reward is lost by finishing."""
    paid_to_the_end, finished = scores("straight to A, then to B")
    assert finished > 0.97 and paid_to_the_end < 15
    paid_for_staying, finished = scores("straight to A, and stays")
    assert finished < 0.1 and paid_for_staying > 40


def test_a_baseline_gets_our_environment_and_nobody_else_does(tmp_path) -> None:
    checkout(tmp_path)
    own = jaxmarl.make
    env = jaxmarl_baseline.load_on_ours(tmp_path).make_train(
        "rover-t2-c1", poi_values=(100.0, 100.0), **CLOSE_TO_A
    )
    assert (env.name, env.env.config.poi_values) == ("rover-t2-c1", (100.0, 100.0))
    assert jaxmarl.make is own


def test_a_baseline_that_was_changed_is_refused(tmp_path) -> None:
    file = checkout(tmp_path)
    assert len(commit(tmp_path, jaxmarl_baseline.FOLDER)) == 40
    file.write_text(BASELINE + "# faster\n")
    with pytest.raises(SystemExit, match="baselines was changed"):
        commit(tmp_path, jaxmarl_baseline.FOLDER)


def test_a_folder_that_is_no_checkout_is_refused(tmp_path) -> None:
    with pytest.raises(SystemExit, match="not a git repository"):
        commit(tmp_path, jaxmarl_baseline.FOLDER)
