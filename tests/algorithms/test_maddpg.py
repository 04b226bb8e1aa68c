"""MADDPG and MATD3 on tasks whose best actions are known, and what they draw and keep."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import skillcrew as sc
from algorithms.test_independent import LEARNER, QUICK, trained
from credit.test_difference import Wheels
from oracles.aiming import AGENTS, TARGETS, Aiming
from oracles.matching import BEST, CHOICES, Matching
from oracles.mixed import Mixed
from oracles.refusals import refusal, unhooked
from oracles.toy import Toy
from skillcrew.algorithms import joint_learning
from skillcrew.policies.network import NetworkConfig
from skillcrew.rollout import Start, Trajectories, rollout

NOBODY = "unknown critic_sharing 'everyone'; valid, nearest first: agent, team"


@pytest.mark.parametrize(
    ("kind", "fields", "within"),
    [
        (sc.MADDPG, {"reward": "own"}, 0.2),
        (sc.MATD3, {"reward": "team", "critic_sharing": "team", "ensemble": 2}, 0.25),
    ],
)
def test_each_agent_learns_its_own_target(kind: Any, fields: dict[str, Any], within: float) -> None:
    learner = {
        name: getattr(kind.config_class().learner, name)
        for name in ("critics", "policy_delay", "target_noise")
    }
    algorithm = kind(
        Aiming(), learner=sc.MADDPGLearnerConfig(**{**learner, **LEARNER}), **{**QUICK, **fields}
    )
    action, metrics = trained(algorithm)
    np.testing.assert_allclose(action, TARGETS, atol=within)
    # Two steps in each of seven episodes; a row is a step of all three agents.
    np.testing.assert_array_equal(metrics["environment_steps"], 14 * np.arange(1, 61))
    assert metrics["transitions_held"][[0, -1]].tolist() == [14, 800]
    assert metrics["fitness_mean"][-5:].mean() > metrics["fitness_mean"][:5].mean()


def test_agents_agree_on_discrete_actions() -> None:
    learner = sc.MADDPGLearnerConfig(
        batch_size=64, soft_update=0.1, network=NetworkConfig(hidden=(16,), input_scaling="none")
    )
    algorithm = sc.MADDPG(Matching(), episodes=40, updates=40, learner=learner, buffer_capacity=4000)

    def run(key):
        return jax.lax.scan(lambda s, _: algorithm.step(s), algorithm.init(key), length=60)[0]

    team = algorithm.team(jax.jit(run)(jax.random.key(0)))
    seen = jnp.stack([jnp.eye(CHOICES), jnp.zeros((CHOICES, CHOICES))], axis=1)
    act = jax.vmap(lambda shown: team.act(shown, team.initial_memory(), jax.random.key(1))[0])
    np.testing.assert_array_equal(jax.jit(act)(seen), BEST)


def explored(algorithm: Any, state: Any, worlds: int) -> Trajectories:
    """What its explorers live."""

    @jax.jit
    def live(state: Any) -> Trajectories:
        start = Start.draw(algorithm.env, jax.random.key(1), worlds)
        lineup = algorithm._actors.explorers(jax.random.key(2), state.actors, start)
        return rollout(algorithm.env, lineup, jax.random.key(3))[1]

    return live(state)


def test_in_each_episode_one_policy_of_each_agent_acts() -> None:
    algorithm = sc.MADDPG(Aiming(), ensemble=3, exploration_noise=0.0, learner=sc.MADDPGLearnerConfig())
    state = jax.jit(algorithm.init)(jax.random.key(0))
    lived = explored(algorithm, state, 40)
    np.testing.assert_array_equal(lived.choice[0], lived.choice[1])
    together = {tuple(row) for row in np.asarray(lived.choice[0])}
    assert {policy for row in together for policy in row} == {0, 1, 2}
    assert len(together) > 12, "agents draw apart from each other"
    actors, lived = jax.device_get((state.actors.learners.actor, lived))
    act = jax.jit(lambda actor: actor(jnp.full(4, 0.5)))
    for world in range(5):
        for agent in range(AGENTS):
            own = jax.tree.map(lambda leaf, a=agent, w=world: leaf[0, a, lived.choice[0, w, a]], actors)
            np.testing.assert_allclose(lived.action[0, world, agent], act(own), rtol=1e-5)
    # The champion is made of the first of each.
    seen = jnp.full((AGENTS, 4), 0.5)
    say = jax.jit(lambda state: algorithm.team(state).act(seen, jnp.zeros((AGENTS, 0)), jax.random.key(4)))
    action, _, choice = say(state)
    first = jax.tree.map(lambda leaf: leaf[0, :, 0], actors)
    np.testing.assert_allclose(action, jax.vmap(act)(first), rtol=1e-5)
    assert choice.tolist() == [0] * AGENTS


def test_discrete_explorers_act_by_their_chances_and_now_and_then_at_random() -> None:
    for noise, rest in ((0.0, 0.0), (0.4, 0.4)):
        algorithm = sc.MADDPG(Matching(), exploration_noise=noise)
        state = jax.jit(algorithm.init)(jax.random.key(5))
        lived = explored(algorithm, state, 6000)
        blind = jax.tree.map(lambda leaf: leaf[0, 1, 0], state.actors.learners.actor)
        chances = jax.nn.softmax(blind.before_squashing(jnp.zeros(CHOICES)))
        expected = (1 - rest) * chances + rest / CHOICES
        np.testing.assert_allclose(lived.action[0, :, 1].mean(0), expected, atol=0.025)


@pytest.mark.parametrize("reward", ["team", "push+turn"])
def test_a_row_is_a_step_of_the_whole_team(reward: str) -> None:
    env = Toy()
    algorithm = sc.MADDPG(env, reward=reward, ensemble=2, task_ends_value=True)
    learning = algorithm._actors
    lived = explored(algorithm, jax.jit(algorithm.init)(jax.random.key(0)), 8)
    rows, mask = learning._rows_of(lived)
    batch = jax.device_get(learning._batch(rows))
    lived, number = jax.device_get(lived), 0
    assert lived.terminated.any() and not lived.mask.all()
    for time in range(env.episode_length):
        for world in range(8):
            assert mask[number] == lived.mask[time, world]
            for field in ("observation", "action", "next_observation"):
                ours = getattr(batch, field)[number]
                np.testing.assert_array_equal(ours, getattr(lived, field)[time, world])
            np.testing.assert_array_equal(batch.acted[number], lived.choice[time, world])
            # Where time was up nothing ends.
            np.testing.assert_array_equal(batch.terminated[number], 1.0 * lived.terminated[time, world])
            paid = lived.team_reward[time, world]
            if reward != "team":
                paid = lived.local_rewards[time, world][:, [1, 3]].sum(1)
            np.testing.assert_allclose(batch.reward[number], np.broadcast_to(paid, env.n_agents), rtol=1e-6)
            number += 1
    assert not sc.MADDPG(env, task_ends_value=False)._actors._batch(rows).terminated.any()


def test_agents_may_be_paid_their_part_of_the_team_s_reward() -> None:
    algorithm = sc.MATD3(Wheels(), reward="D")
    env, learning = algorithm._lived_in, algorithm._actors

    @jax.jit
    def explored(key):
        start = Start.draw(env, jax.random.key(1), 3)
        lineup = learning.explorers(jax.random.key(2), algorithm.init(key).actors, start)
        lived = rollout(env, lineup, jax.random.key(3))[1]
        return lived, learning._batch(learning._rows_of(lived)[0])

    lived, batch = jax.device_get(explored(jax.random.key(0)))
    np.testing.assert_allclose(batch.reward, lived.action[0, ..., 0] * Wheels.ways[None], rtol=1e-5)


def test_what_both_are_by_default() -> None:
    plain, twins = sc.MADDPG(Aiming()).config.learner, sc.MATD3(Aiming()).config.learner
    assert (plain.critics, plain.policy_delay, plain.target_noise) == (1, 1, 0.0)
    assert (twins.critics, twins.policy_delay, twins.target_noise) == (2, 2, 0.2)
    assert plain.discount == twins.discount == 0.95


def test_a_buffer_takes_as_much_memory_as_that_of_learners_of_their_own() -> None:
    rows = jax.eval_shape(sc.MADDPG(Toy()).init, jax.random.key(0)).actors.experience.experience
    # Three agents see 5 numbers, do 2 by one policy and are paid 4; the team's reward; whether it ended.
    assert rows.shape == (1, 1, 100_000, 3 * (5 + 2 + 1 + 5 + 4) + 2)


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        (
            {"critic_sharing": "everyone"},
            NOBODY,
        ),
        ({"ensemble": 0}, "ensemble = 0: give at least 1 policy"),
        ({"updates": 0}, "updates = 0: give at least 1"),
        ({"exploration_noise": -0.5}, "exploration_noise = -0.5: give a number of at least 0"),
    ],
)
def test_refuses_what_cannot_be_meant(fields: dict[str, Any], said: str) -> None:
    assert refusal(unhooked(joint_learning).JointLearningConfig, **fields) == said


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"updates": 3}, "updates = 3: give a multiple of learner.policy_delay = 2"),
        ({"episodes": 0}, "episodes = 0: give at least 1"),
        ({"reward": "nothing"}, "unknown reward 'nothing'"),
        ({"buffer_capacity": 59}, "buffer_capacity = 59: smaller than the 60 transitions"),
        ({"population": 3}, "unknown field of matd3 'population'"),
    ],
)
def test_refuses_as_other_learners_do(fields: dict[str, Any], said: str) -> None:
    with pytest.raises(sc.UserError, match=said):
        sc.MATD3(Aiming(), **fields)


def test_one_actor_cannot_be_all_of_agents_that_differ() -> None:
    with pytest.raises(sc.UserError, match=r"sharing = team: agents of mixed differ \(scout, hauler\)"):
        sc.MADDPG(Mixed(), sharing="team")
    sc.MADDPG(Mixed(), critic_sharing="team")
