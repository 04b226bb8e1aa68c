"""Recorded episodes: those that `rollout` would play, of which the ones worth showing are kept."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import skillcrew as sc
from analysis.page import meadow
from skillcrew.envs.environment import Environment, TimeStep
from skillcrew.envs.scene import Points, Scene
from skillcrew.experiment import recording
from skillcrew.experiment.recording import (
    check_scene,
    episodes_of,
    record,
    shown_episodes,
    worth_showing,
)
from skillcrew.rollout import Lineup, Start, rollout


class Dice(Environment):
    """Where agents are is drawn at each step, as is when it ends."""

    name = "dice"
    n_agents = 2
    observation_size = 2
    action_size = 1
    episode_length = 5
    skills = ("roll",)

    def reset(self, key):
        position = jax.random.uniform(key, (2, 2))
        return position, position

    def step(self, state, action, key):
        position = jax.random.uniform(key, (2, 2)) + action
        done = position[0, 0] > 1.2
        reward = position.sum()
        return position, TimeStep(position, jnp.zeros((2, 1)), reward, done, jnp.zeros((), bool))

    def scene(self, state):
        return Scene((0.0, 0.0), (1.0, 1.0), points=(Points("agents", state),))


class Rollers(eqx.Module):
    """They do and choose by chance."""

    def initial_memory(self):
        return jnp.zeros(())

    def act(self, observation, memory, key):
        choice = jax.random.randint(key, (2,), 0, 3) + memory.astype(jnp.int32)
        return jax.random.uniform(key, (2, 1)) * observation[:, :1], memory + 1, choice


def test_what_is_recorded_is_what_rollout_plays():
    env, key = Dice(), jax.random.key(3)

    @jax.jit
    def both(key):
        lineup = Lineup.of_team(Rollers(), Start.draw(env, key, 20))
        return record(env, lineup, key), rollout(env, lineup, key)[1]

    recorded, played = jax.tree.map(np.asarray, both(key))
    for field in ("observation", "choice", "team_reward", "terminated", "mask"):
        expected = np.moveaxis(getattr(played, field), 1, 0)
        np.testing.assert_array_equal(getattr(recorded, field), expected, err_msg=field)
    position = recorded.scene.points[0].position
    assert position.shape == (20, env.episode_length + 1, 2, 2)
    np.testing.assert_array_equal(position[:, :-1], recorded.observation)
    np.testing.assert_array_equal(position[:, 1:], np.moveaxis(played.next_observation, 1, 0))


def test_episodes_are_the_runs_own_and_always_the_same():
    shown = meadow.contents().shown
    assert [one.seed for one in shown] == list(meadow.SEEDS)
    for one in shown:
        assert len(one.number) == 20 and one.played == recording.PLAYED
        assert (one.steps[one.solved] < meadow.LENGTH + 1).all() and (
            one.steps[~one.solved] == meadow.LENGTH
        ).all()
        np.testing.assert_array_equal(one.returns, one.solved)
        assert one.recording.choice.shape == (20, meadow.LENGTH, 2)
    assert not np.array_equal(shown[0].steps, shown[1].steps), "seeds have the same worlds"
    again = shown_episodes(meadow.a_run(meadow.Meadow()))
    for one, other in zip(shown, again, strict=True):
        for leaf, same in zip(jax.tree.leaves(one), jax.tree.leaves(other), strict=True):
            np.testing.assert_array_equal(leaf, same)


def test_those_of_the_page_are_among_all_by_their_numbers():
    (_, shown), run = meadow.contents().shown, meadow.a_run(meadow.Meadow())
    played = episodes_of(run, 11)
    assert (played.seed, len(played.steps)) == (11, recording.PLAYED)
    np.testing.assert_array_equal(played.steps[shown.number], shown.steps)
    kept = played.recording.episodes(shown.number)
    for leaf, same in zip(jax.tree.leaves(kept), jax.tree.leaves(shown.recording), strict=True):
        np.testing.assert_array_equal(leaf, same)
    with pytest.raises(sc.UserError, match="seed 4: not of this run, which has 3, 11"):
        episodes_of(run, 4)


def test_fewer_are_played_where_worlds_are_large(monkeypatch):
    monkeypatch.setattr(recording, "MOST_NUMBERS", 1)
    monkeypatch.setattr(recording, "PLAYED", 3)
    assert {one.played for one in shown_episodes(meadow.a_run(meadow.Bare()), count=2)} == {2}


SOLVED = np.array([False] * 60 + [True] * 40)
STEPS = np.array([50] * 60 + [30] * 39 + [7])


def chosen(solved, returns, steps, count):
    return worth_showing(solved, np.asarray(returns, float), np.asarray(steps), count).tolist()


def test_solved_and_failed_as_often_as_they_happened_and_the_fastest():
    assert chosen(SOLVED, SOLVED, STEPS, 10) == [0, 1, 2, 3, 4, 5, 60, 61, 62, 99]


@pytest.mark.parametrize("few", [0, 1, 2, 98, 99, 100])
def test_what_is_rare_is_among_them(few):
    solved = np.arange(100) < few
    which = chosen(solved, solved, np.full(100, 9), 20)
    assert len(which) == len(set(which)) == 20 and which == sorted(which)
    assert sum(solved[which]) == min(few, max(5, round(20 * few / 100)), 15 if few < 100 else 20) or few > 94
    assert sum(~solved[which]) >= min(100 - few, 5) and sum(solved[which]) >= min(few, 5)


def test_where_there_is_no_success_the_best_and_the_worst():
    returns = np.zeros(30)
    returns[[20, 25]] = 3.0, -2.0
    assert chosen(None, returns, np.full(30, 9), 4) == [0, 1, 20, 25]
    assert chosen(None, np.zeros(3), np.full(3, 9), 20) == [0, 1, 2]
    assert chosen(np.array([True]), [1.0], [4], 20) == [0]


def test_a_scene_of_the_wrong_shape_is_refused():
    class Skewed(Dice):
        def scene(self, state):
            return eqx.tree_at(lambda one: one.points[0].position, super().scene(state), state[:, 0])

    with pytest.raises(sc.UserError, match=r"scene of skewed: has points\[0\] .*; make it of the shape"):
        check_scene(Skewed())

    class Torn(Dice):
        def scene(self, state):
            raise RuntimeError("no licence")

    with pytest.raises(sc.UserError, match="scene of torn: fails with RuntimeError: no licence"):
        check_scene(Torn())
    check_scene(Dice())
    check_scene(meadow.Bare())
