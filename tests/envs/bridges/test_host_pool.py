"""Worlds on the host: found again, forked, forgotten and replayed, all to the same result."""

import numpy as np
import pytest

from envs.bridges.walk import ALIKE, Walk, live
from skillcrew.envs.bridges import host_pool
from skillcrew.envs.bridges.host_pool import Pool

LENGTH, NUMBERS = 7, 4


class Told:
    """A pool, and the stories of a batch of its worlds."""

    def __init__(self, seeds, pool=None, **options):
        self.made = []
        self.pool = pool or Pool(lambda: self._made(**options), self._made(**options))
        self.seeds = np.array(seeds, np.uint32)
        count = len(seeds)
        self.time = np.zeros(count, np.int32)
        self.digest = np.zeros((count, 2), np.uint32)
        self.past = np.zeros((count, LENGTH, NUMBERS), np.float32)

    def _made(self, **options):
        self.made.append(Walk(ALIKE, ends=False, **options))
        return self.made[-1]

    @property
    def resets(self):
        return sum(world.resets for world in self.made)

    def step(self, actions):
        actions = np.asarray(actions, np.float32)
        over = np.zeros(len(self.seeds), bool)
        moved, self.digest = self.pool.step(self.seeds, self.time, self.digest, self.past, over, actions)
        self.past[np.arange(len(self.seeds)), self.time] = actions
        self.time = self.time + 1
        return moved


def actions_of(worlds, time):
    return np.random.default_rng(time).uniform(-1, 1, (worlds, NUMBERS)).astype(np.float32)


def test_side_by_side_each_world_goes_its_own_way_and_none_is_replayed():
    told = Told([5, 9, 5, 2])
    shown = told.pool.reset(told.seeds)
    resets = told.resets
    steps = [told.step(actions_of(4, time)) for time in range(5)]
    for world, seed in enumerate(told.seeds):
        seen, moved = live(ALIKE, int(seed), [actions_of(4, time)[world] for time in range(5)], ends=False)
        np.testing.assert_array_equal(shown[world], seen[0])
        for time in range(5):
            np.testing.assert_array_equal(steps[time][world].observation, moved[time].observation)
            np.testing.assert_array_equal(steps[time][world].rewards, moved[time].rewards)
    assert told.resets == resets == len(told.made) == 4


def test_worlds_that_have_acted_alike_so_far_are_told_apart_from_then_on():
    told = Told([5, 5, 5])
    told.pool.reset(told.seeds)
    same = np.tile(actions_of(1, 0), (3, 1))
    told.step(same)
    other = actions_of(3, 1)
    moved = told.step(other)
    for world in range(3):
        alone = live(ALIKE, 5, [same[0], other[world]], ends=False)[1][-1]
        np.testing.assert_array_equal(moved[world].observation, alone.observation)
    assert told.resets == 3, "none was replayed"


def test_a_fork_and_a_story_from_elsewhere_are_replayed():
    told = Told([5, 8])
    told.pool.reset(told.seeds)
    first, second = actions_of(2, 0), actions_of(2, 1)
    told.step(first)
    kept = (told.time, told.digest, told.past.copy())
    ahead = told.step(second)
    told.time, told.digest, told.past = kept
    again = told.step(second)
    elsewhere = Told([5, 8])
    elsewhere.time, elsewhere.digest, elsewhere.past = kept[0], kept[1], kept[2].copy()
    there = elsewhere.step(second)
    for world in range(2):
        for moved in (again, there):
            np.testing.assert_array_equal(moved[world].observation, ahead[world].observation)
    assert told.resets == 4


def test_no_more_worlds_are_kept_than_two_batches_take(monkeypatch):
    monkeypatch.setattr(host_pool, "FEWEST", 4)
    batches = [Told([1, 2])]
    batches += [Told(seeds, batches[0].pool) for seeds in ([3, 4, 5], [6, 7, 8], [9])]
    for time in range(4):
        for batch in batches:
            moved = batch.step(actions_of(len(batch.seeds), time))
            for world, seed in enumerate(batch.seeds):
                past = batch.past[world, : time + 1]
                alone = live(ALIKE, int(seed), list(past), ends=False)[1][-1]
                np.testing.assert_array_equal(moved[world].observation, alone.observation)
    assert len(batches[0].made) == 6


def test_after_a_world_fails_the_others_are_replayed():
    told = Told([5, 8])
    told.pool.reset(told.seeds)
    told.step(actions_of(2, 0))
    told.made[1].broken = True
    with pytest.raises(RuntimeError, match="gave up"):
        told.step(actions_of(2, 1))
    moved = told.step(actions_of(2, 2))
    for world, seed in enumerate((5, 8)):
        alone = live(ALIKE, seed, [actions_of(2, 0)[world], actions_of(2, 2)[world]], ends=False)[1][-1]
        np.testing.assert_array_equal(moved[world].observation, alone.observation)
