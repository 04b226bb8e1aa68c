"""The estimate of memory, said before anything is compiled."""

import dataclasses

import jax.numpy as jnp
import pytest

import skillcrew as sc
from experiment.tiny import SEEDS, last_arrays, tiny_madys
from skillcrew.algorithms.registry import algorithm_class, make_algorithm
from skillcrew.experiment import device_memory, memory
from skillcrew.experiment.config import RunConfig
from skillcrew.experiment.generation import compiled


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
    monkeypatch.setattr(device_memory, "available", lambda: memory.BASE)
    with pytest.raises(sc.UserError, match=r"needs about .*GiB.*buffer-capacity") as caught:
        sc.train(tiny_madys(), out=tmp_path / "run")
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "run").exists()


def test_a_run_that_does_not_fit_is_not_resumed(monkeypatch, finished):
    monkeypatch.setattr(device_memory, "available", lambda: memory.BASE)
    with pytest.raises(sc.UserError, match="this run needs about"):
        sc.Run(finished).resume()


@pytest.mark.parametrize("name", ["madys", "td3", "maddpg", "merl"])
def test_mini_batches_are_part_of_the_estimate(name):
    env = sc.make("rover-t2-c2", episode_length=6)

    def estimated(batch_size):
        config = algorithm_class(name)(env).config
        learner = dataclasses.replace(config.learner, batch_size=batch_size)
        return beyond_base(make_algorithm(name, env, dataclasses.replace(config, learner=learner)))

    assert estimated(200_000) > estimated(100_000) > 2 * estimated(100)
    assert estimated(200_000) > 200_000 * 2 * (env.observation_size + env.action_size) * 4


def test_a_program_that_would_take_more_than_there_is_is_refused_before_it_runs(monkeypatch):
    size = 1 << 20

    def spread(vector):
        return jnp.sort((vector[:, None] * vector[None, :]).ravel())[:3]

    vector = jnp.ones(1 << 10)
    monkeypatch.setattr(device_memory, "available", lambda: 4 * size // 2)
    with pytest.raises(sc.UserError, match=r"needs about .*and the machine has 0\.0 GiB free; lower"):
        compiled(spread, vector)
    monkeypatch.setattr(device_memory, "available", lambda: 40 * size)
    assert compiled(spread, vector)(vector).tolist() == [1, 1, 1]


def test_huge_buffers_are_estimated_without_being_made():
    huge = dataclasses.replace(tiny_madys().config, buffer_capacity=2_000_000_000)
    needed = memory.estimate(sc.MADyS(sc.make("rover-t2-c2", episode_length=6), huge), RunConfig())
    assert needed > 100 * 2**30
    assert 0 < device_memory.available() < 2**50
    assert device_memory.in_gib(3 * 2**29) == "1.5 GiB"
