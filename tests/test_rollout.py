"""Algorithm 2 in one scan, against a Python loop over teams, episodes and steps."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oracles.toy import ACTION, AGENTS, LENGTH, SKILLS, Toy, ToyTeam, live
from skillcrew.rollout import MOST_COUNTED, Lineup, Start, Trajectories, count_steps, rollout

TEAMS, EPISODES, OTHERS = 4, 5, 2
ENV = Toy()


def teams_of(key) -> ToyTeam:
    return jax.vmap(ToyTeam.create)(jax.random.split(key, TEAMS))


def live_all(key, noise: float, recorded: Any = slice(None), living: Any = None) -> dict[str, Any]:
    """All teams in the same episodes; beside them one more team, in the first of these episodes."""
    key_teams, key_other, key_start, key = jax.random.split(key, 4)
    teams, other = teams_of(key_teams), ToyTeam.create(key_other)
    start = Start.draw(ENV, key_start, EPISODES)
    lineup = Lineup.of_teams(ToyTeam, teams.weights, TEAMS, start)
    lineup = lineup.beside(Lineup.of_team(other, start.first(OTHERS)))
    episodes, lived = rollout(ENV, lineup, key, noise, recorded, living)
    return {
        "lived": lived,
        "episodes": episodes,
        "teams": teams,
        "other": other,
        "start": start,
        "returns": episodes.team_return(),
        "discounted": episodes.team_return(0.5),
        "completed": episodes.completed(),
    }


@pytest.fixture(scope="module")
def quiet() -> dict[str, Any]:
    return jax.jit(lambda key: live_all(key, 0.0))(jax.random.key(0))


@pytest.fixture(scope="module")
def episodes(quiet) -> list:
    """The Python loop's steps of each world, in the order of the rollout's worlds."""
    offset, limit = (np.asarray(quiet["start"].state[name]) for name in ("offset", "limit"))
    by_team = [
        live(np.asarray(weights), offset[:, e], int(limit[e]))
        for weights in quiet["teams"].weights
        for e in range(EPISODES)
    ]
    other = np.asarray(quiet["other"].weights)
    return by_team + [live(other, offset[:, e], int(limit[e])) for e in range(OTHERS)]


def test_episodes_end_at_different_times_and_for_both_reasons(episodes) -> None:
    assert len({len(steps) for steps in episodes}) > 2
    assert {steps[-1].terminated for steps in episodes} == {True, False}
    # Some are cut off before the longest episode ends.
    assert any(len(steps) < LENGTH and not steps[-1].terminated for steps in episodes)


@pytest.mark.parametrize(
    "field", ["observation", "action", "next_observation", "local_rewards", "team_reward"]
)
def test_every_lived_step_is_that_of_the_loop(quiet, episodes, field: str) -> None:
    values = np.asarray(getattr(quiet["lived"], field))
    for world, steps in enumerate(episodes):
        expected = np.array([getattr(step, field) for step in steps])
        np.testing.assert_allclose(values[: len(steps), world], expected, rtol=1e-4, atol=1e-4)


def test_choices_and_ends_are_those_of_the_loop(quiet, episodes) -> None:
    for world, steps in enumerate(episodes):
        lived: Trajectories = quiet["lived"].worlds(slice(world, world + 1))
        assert lived.mask[:, 0].tolist() == [time < len(steps) for time in range(LENGTH)]
        assert lived.terminated[: len(steps), 0].tolist() == [step.terminated for step in steps]
        assert lived.choice[: len(steps), 0].tolist() == [step.choice for step in steps]


def test_the_last_next_observation_is_that_of_the_last_state(quiet, episodes) -> None:
    for world, steps in enumerate(episodes):
        last = np.asarray(quiet["lived"].next_observation[len(steps) - 1, world])
        # The clock has gone on: neither a fresh world, nor one stepped after its end.
        assert last[:, 3].tolist() == [len(steps)] * AGENTS


def test_return_and_steps_leave_padding_out(quiet, episodes) -> None:
    expected = [sum(step.team_reward for step in steps) for steps in episodes]
    np.testing.assert_allclose(quiet["returns"], expected, rtol=1e-4, atol=1e-4)
    halved = [sum(0.5**t * step.team_reward for t, step in enumerate(steps)) for steps in episodes]
    np.testing.assert_allclose(quiet["discounted"], halved, rtol=1e-4, atol=1e-4)
    for told in (quiet["lived"], quiet["episodes"]):
        assert int(told.steps()) == sum(len(steps) for steps in episodes)
    assert len(episodes) * LENGTH > int(quiet["episodes"].steps())


def test_an_episode_is_completed_if_the_task_was_done_before_its_end(quiet, episodes) -> None:
    assert quiet["completed"].tolist() == [steps[-1].terminated for steps in episodes]


@pytest.mark.parametrize(
    "recorded", [np.array([3, 17, 0, 21]), slice(0), slice(4, 13, 2)], ids=["some", "none", "slice"]
)
def test_only_the_recorded_worlds_are_told_in_full_and_all_in_brief(quiet, recorded) -> None:
    told = jax.jit(lambda key: live_all(key, 0.0, recorded))(jax.random.key(0))
    for one, other in zip(
        jax.tree.leaves(told["lived"]), jax.tree.leaves(quiet["lived"].worlds(recorded)), strict=True
    ):
        np.testing.assert_allclose(one, other, rtol=1e-5, atol=1e-5)
    for field in ("team_reward", "terminated", "mask"):
        values = getattr(told["episodes"], field)
        np.testing.assert_allclose(values, getattr(quiet["lived"], field), rtol=1e-5, atol=1e-5)
        assert values.shape == (LENGTH, TEAMS * EPISODES + OTHERS)


def test_worlds_without_an_episode_count_no_step_and_change_no_other(quiet) -> None:
    idle = [1, 7, TEAMS * EPISODES + 1]
    living = np.ones(TEAMS * EPISODES + OTHERS, bool)
    living[idle] = False
    some = jax.jit(lambda key: live_all(key, 0.0, living=jnp.asarray(living)))(jax.random.key(0))
    assert not np.asarray(some["lived"].mask)[:, idle].any()
    assert not np.asarray(some["returns"])[idle].any()
    for before, after in zip(jax.tree.leaves(quiet["lived"]), jax.tree.leaves(some["lived"]), strict=True):
        np.testing.assert_array_equal(np.asarray(after)[:, living], np.asarray(before)[:, living])
    steps = np.asarray(quiet["episodes"].mask)
    assert some["episodes"].steps() == steps[:, living].sum() < steps.sum()


def test_each_team_lives_as_it_does_alone(quiet) -> None:
    @jax.jit
    def alone(weights, start):
        return rollout(ENV, Lineup.of_team(ToyTeam(weights), start), jax.random.key(9))[1]

    for team in range(TEAMS):
        mine = quiet["lived"].worlds(slice(team * EPISODES, (team + 1) * EPISODES))
        expected = alone(quiet["teams"].weights[team], quiet["start"])
        for one, other in zip(jax.tree.leaves(mine), jax.tree.leaves(expected), strict=True):
            np.testing.assert_allclose(one, other, rtol=1e-4, atol=1e-4)


def test_all_teams_meet_the_same_worlds_which_differ_from_each_other(quiet) -> None:
    first = np.asarray(quiet["lived"].observation[0])[: TEAMS * EPISODES]
    by_team = first.reshape(TEAMS, EPISODES, AGENTS, -1)
    assert (by_team == by_team[:1]).all()
    offsets = by_team[0, :, :, 0]
    assert len(np.unique(offsets)) == offsets.size
    np.testing.assert_array_equal(first[:OTHERS], np.asarray(quiet["lived"].observation[0])[-OTHERS:])


def test_another_key_draws_other_worlds() -> None:
    one, other = (Start.draw(ENV, jax.random.key(seed), EPISODES).observation for seed in (1, 2))
    assert one.shape == (AGENTS, ENV.observation_size, EPISODES)
    assert not np.isin(np.asarray(one)[:, 0], np.asarray(other)[:, 0]).any()


class Still(ToyTeam):
    """Never acts, and chooses by its key, to show what keys and noise it is given."""

    def act(self, observation, memory, key):
        choice = jax.random.randint(key, (AGENTS,), 0, SKILLS, dtype=jnp.int32)
        return jnp.zeros((AGENTS, ACTION)), memory, choice


WORLDS = 300


@pytest.fixture(scope="module", params=[0.3, 5.0])
def noisy(request) -> tuple[float, Trajectories]:
    @jax.jit
    def run(key):
        start = Start.draw(ENV, key, WORLDS)
        return rollout(ENV, Lineup.of_team(Still(None), start), key, request.param)[1]

    return request.param, run(jax.random.key(3))


def test_noise_has_its_deviation_and_is_clipped(noisy) -> None:
    noise, lived = noisy
    action = np.asarray(lived.action)
    drawn = np.clip(noise * np.random.default_rng(0).normal(size=100_000), -1, 1)
    assert action.mean() == pytest.approx(0, abs=0.03)
    assert action.std() == pytest.approx(drawn.std(), rel=0.02)
    assert np.abs(action).max() <= 1
    assert (np.abs(action) == 1).mean() == pytest.approx((np.abs(drawn) == 1).mean(), abs=0.01)


def test_noise_is_on_what_the_environment_receives_and_is_recorded(noisy) -> None:
    lived = noisy[1]
    moved = np.asarray(lived.next_observation - lived.observation)[..., 1:3]
    alive = np.asarray(lived.mask)
    np.testing.assert_allclose(moved[alive], np.asarray(lived.action)[alive], atol=1e-4)


def test_every_world_step_and_agent_has_noise_of_its_own(noisy) -> None:
    lived = noisy[1].worlds(slice(0, 7))
    action = np.asarray(lived.action)
    drawn = action[np.abs(action) < 1]
    assert drawn.size > 20
    assert len(np.unique(drawn)) == drawn.size
    # … and a key of its own for what teams draw.
    choices = np.asarray(lived.choice).reshape(LENGTH * 7, AGENTS)
    assert len(np.unique(choices, axis=0)) > 20


def test_of_pairs_each_team_lives_in_its_own_world() -> None:
    """The first team in the first world, and so on."""

    def run(key):
        teams, start = teams_of(key), Start.draw(ENV, jax.random.key(8), TEAMS)
        lineup = Lineup.of_pairs(ToyTeam, teams.weights, start)
        return teams, start, rollout(ENV, lineup, jax.random.key(9))[0]

    teams, start, lived = jax.device_get(jax.jit(run)(jax.random.key(7)))
    offset, limit = start.state["offset"], start.state["limit"]
    returns = []
    for team in range(TEAMS):
        steps = live(np.asarray(teams.weights[team]), offset[:, team], int(limit[team]))
        returns.append(sum(step.team_reward for step in steps))
        assert int(lived.mask[:, team].sum()) == len(steps)
    np.testing.assert_allclose(lived.team_return(), returns, rtol=1e-4, atol=1e-4)
    assert len(np.unique(np.round(returns, 4))) == TEAMS


counts = st.integers(0, MOST_COUNTED)


@given(counts, counts, counts)
def test_a_count_of_steps_that_is_full_stays_full(before, lived, raced) -> None:
    count = count_steps(jnp.int32(before), jnp.int32(lived), jnp.int32(raced))
    assert count.dtype == jnp.int32
    assert int(count) == min(before + lived + raced, MOST_COUNTED)
