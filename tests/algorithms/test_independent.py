"""Independent learners on a task whose best actions are known; unequal numbers throughout."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import skillcrew as sc
from oracles.aiming import AGENTS, COMMON, TARGETS, Aiming
from oracles.refusals import refusal, unhooked
from skillcrew.algorithms import learning_alone
from skillcrew.credit.reward import LearnedReward
from skillcrew.policies.network import NetworkConfig

QUICK: dict[str, Any] = {
    "episodes": 7,
    "updates": 80,
    "exploration_noise": 0.5,
    "buffer_capacity": 2400,
}
LEARNER: dict[str, Any] = {
    "discount": 0.0,
    "batch_size": 32,
    "actor_learning_rate": 5e-3,
    "critic_learning_rate": 1e-2,
    "saturation_penalty": 0.003,
    "network": NetworkConfig(hidden=(16,), input_scaling="none"),
}


def trained(algorithm: Any, generations: int = 60) -> tuple[np.ndarray, Any]:
    """What each agent does after training, and the metrics of every generation."""

    @jax.jit
    def run(key):
        state = algorithm.init(key)
        state, metrics = jax.lax.scan(lambda carry, _: algorithm.step(carry), state, length=generations)
        team = algorithm.team(state)
        return team.act(jnp.full((AGENTS, 4), 0.5), team.initial_memory(), jax.random.key(2)), metrics

    (action, _, choice), metrics = run(jax.random.key(0))
    assert choice.tolist() == [0] * AGENTS
    return np.asarray(action[:, 0]), jax.device_get(metrics)


# The team's reward is a third of an agent's own, and two thirds of it are the others' doing.
@pytest.mark.parametrize(("reward", "within"), [("own", 0.2), ("team", 0.25)])
def test_each_agent_learns_its_own_target_from_its_own_transitions(reward: str, within: float) -> None:
    algorithm = sc.IndependentTD3(Aiming(), reward=reward, learner=sc.TD3Config(**LEARNER), **QUICK)
    action, metrics = trained(algorithm)
    np.testing.assert_allclose(action, TARGETS, atol=within)
    # Two steps in each of seven episodes.
    np.testing.assert_array_equal(metrics["environment_steps"], 14 * np.arange(1, 61))
    assert metrics["transitions_held"][[0, -1]].tolist() == [42, 2400]
    assert (metrics["fitness_best"] > metrics["fitness_mean"]).all()
    assert metrics["fitness_mean"][-5:].mean() > metrics["fitness_mean"][:5].mean()


def test_one_actor_for_all_can_only_aim_between_the_targets() -> None:
    learner = sc.TD3Config.ddpg(**LEARNER)
    algorithm = sc.IndependentDDPG(Aiming(), reward="own", sharing="team", learner=learner, **QUICK)
    action, _ = trained(algorithm)
    np.testing.assert_allclose(action, [np.mean(TARGETS)] * AGENTS, atol=0.2)


def test_the_reward_is_the_one_that_was_named() -> None:
    rewards = jnp.array([[1.0, 10.0], [2.0, 20.0], [3.0, 30.0]])
    for reward, expected in {
        "own": [1.0, 2.0, 3.0],
        "common": [10.0, 20.0, 30.0],
        "local": [11.0, 22.0, 33.0],
        "team": [7.0, 7.0, 7.0],
    }.items():
        assert LearnedReward(Aiming(), reward)(rewards, jnp.full(AGENTS, 7.0)).tolist() == expected
    assert COMMON not in TARGETS


def test_another_sharing_is_refused() -> None:
    message = refusal(unhooked(learning_alone).LearningAloneConfig, sharing="everyone")
    assert message == "unknown sharing 'everyone'; valid, nearest first: agent, team"


def test_ddpg_is_td3_without_its_three_additions() -> None:
    learner = sc.IndependentDDPG(Aiming()).config.learner
    assert (learner.critics, learner.policy_delay, learner.target_noise) == (1, 1, 0.0)
    assert sc.IndependentTD3(Aiming()).config.learner.critics == 2


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        ({"reward": "go_to_poi_A"}, ["unknown reward 'go_to_poi_A'", "team, local", "own", "common"]),
        ({"episodes": 0}, ["episodes = 0: give at least 1"]),
        ({"updates": 3}, ["updates = 3", "learner.policy_delay = 2"]),
        ({"exploration_noise": -0.1}, ["exploration_noise = -0.1"]),
        ({"buffer_capacity": 59}, ["buffer_capacity = 59: smaller than the 60 transitions"]),
        ({"population": 3}, ["population"]),
    ],
)
def test_refuses_what_cannot_be_meant(fields: dict[str, Any], expected: list[str]) -> None:
    with pytest.raises(sc.UserError) as refused:
        sc.IndependentTD3(Aiming(), **fields)
    for part in expected:
        assert part in str(refused.value)
