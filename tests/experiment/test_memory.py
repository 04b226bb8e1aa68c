"""The estimate of memory, said before anything is compiled."""

import dataclasses

import pytest

import skillcrew as sc
from experiment.tiny import SEEDS, last_arrays, tiny_madys
from skillcrew.experiment import memory
from skillcrew.experiment.config import RunConfig


def beyond_base(algorithm, seeds=1):
    return memory.estimate(algorithm, RunConfig(seeds=tuple(range(seeds)))) - memory.BASE


def test_the_estimate_grows_with_what_takes_memory():
    small = tiny_madys()
    width = small._skills._buffer.width
    larger = beyond_base(tiny_madys(buffer_capacity=100_400)) - beyond_base(small)
    assert larger == 100_000 * width * 4
    assert beyond_base(small, seeds=5) == 5 * beyond_base(small)
    assert beyond_base(tiny_madys(episodes=4)) > beyond_base(small)
    assert beyond_base(tiny_madys(population=12, buffer_capacity=400)) > beyond_base(small)


def test_the_estimate_is_near_what_the_state_really_takes(finished):
    state = sum(array.nbytes for array in last_arrays(finished)[0].values())
    algorithm = sc.Run(finished).algorithm
    estimated = beyond_base(algorithm, len(SEEDS)) - len(SEEDS) * algorithm.transient_bytes()
    assert state / 2 <= estimated <= 2 * state
    assert algorithm.transient_bytes() > 0


def test_a_run_that_does_not_fit_is_refused_before_anything_is_made(monkeypatch, tmp_path):
    monkeypatch.setattr(memory, "available", lambda: memory.BASE)
    with pytest.raises(sc.UserError, match=r"needs about .*GiB.*buffer-capacity") as caught:
        sc.train(tiny_madys(), out=tmp_path / "run")
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "run").exists()


def test_a_run_that_does_not_fit_is_not_resumed(monkeypatch, finished):
    monkeypatch.setattr(memory, "available", lambda: memory.BASE)
    with pytest.raises(sc.UserError, match="this run needs about"):
        sc.Run(finished).resume()


def test_huge_buffers_are_estimated_without_being_made():
    huge = dataclasses.replace(tiny_madys().config, buffer_capacity=2_000_000_000)
    needed = memory.estimate(sc.MADyS(sc.make("rover-t2-c2", episode_length=6), huge), RunConfig())
    assert needed > 100 * 2**30
    assert 0 < memory.available() < 2**50
    assert memory.in_gib(3 * 2**29) == "1.5 GiB"
