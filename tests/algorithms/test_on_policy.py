"""IPPO, MAPPO, COMA and LIIR as algorithms: what agents decide among, are paid, and learn."""

import dataclasses
import functools
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import skillcrew as sc
from oracles.aiming import AGENTS, TARGETS, Aiming
from oracles.mixed import SKILLS, Mixed
from oracles.picking import LENGTH, Picking
from oracles.refusals import refusal, unhooked
from oracles.toy import Toy
from oracles.training import trained
from skillcrew.algorithms import on_policy, ppo
from skillcrew.algorithms.registry import algorithm_class
from skillcrew.rollout import Lineup, Start, rollout

NAMES = ("ippo", "mappo", "coma", "liir")
SMALL = sc.PolicyConfig(hidden=(16,), input_scaling="none", sharing="team")
OWN = sc.PolicyConfig(hidden=(16,), input_scaling="none", sharing="agent")


def learner(name: str, **fields: Any) -> dict[str, Any]:
    """The section of an algorithm's learner, in which it learns fast."""
    fields = {"learning_rate": 1e-2, "minibatches": 2, **fields}
    kinds = {"coma": sc.COMALearnerConfig, "liir": sc.LIIRLearnerConfig}
    section = name if name in kinds else "ppo"
    return {section: kinds.get(name, sc.PPOConfig)(**fields)}


def episodes_of(algorithm: Any, state: Any, worlds: int) -> tuple[Any, Any]:
    start = Start.draw(algorithm.env, jax.random.key(5), worlds)
    return rollout(algorithm.env, Lineup.of_team(algorithm.team(state), start), jax.random.key(6))


@pytest.mark.parametrize("name", NAMES)
def test_they_learn_to_pick_what_they_are_shown(name: str) -> None:
    """Of four actions; all four methods, on the team's reward alone."""
    more = {"minibatches": 8, "floor_episodes": 400, "epochs": 10} if name == "coma" else {}
    algorithm = algorithm_class(name)(
        Picking(),
        choose="actions",
        episodes=32,
        policy=SMALL,
        critic=SMALL,
        greedy=True,
        **learner(name, discount=0.5, **more),
    )

    def play(state):
        episodes, lived = episodes_of(algorithm, state, 50)
        return episodes.team_return().mean(), lived.choice

    (reached, choice), metrics = trained(algorithm, 40, play)
    assert metrics["fitness_mean"][0] < 0.4
    assert reached > 0.9
    assert not choice.any()
    assert int(metrics["environment_steps"][-1]) == 40 * 32 * LENGTH


@pytest.mark.parametrize("name", ["ippo", "liir"])
def test_continuous_actions_are_learned_too(name: str) -> None:
    """Each agent's target is its own, and only its own network and reward can tell it."""
    section = learner(name, discount=0.0, trace=0.0, entropy=0.0, learning_rate=5e-3)
    kind = {"ippo": sc.IPPO, "liir": sc.LIIR}[name]
    algorithm = kind(Aiming(), reward="own", episodes=64, policy=OWN, critic=OWN, greedy=True, **section)

    def act(state):
        team = algorithm.team(state)
        return team.act(jnp.full((AGENTS, 4), 0.5), team.initial_memory(), jax.random.key(1))[0]

    action, _ = trained(algorithm, 120, act)
    np.testing.assert_allclose(action[:, 0], TARGETS, atol=0.2)


@functools.cache
def choosing_skills() -> tuple[Any, dict, dict]:
    """Agents that differ, each of which can use some of the skills, and three generations of them."""
    network = sc.NetworkConfig(hidden=(8,), input_scaling="none")
    algorithm = sc.MAPPO(
        Mixed(),
        choose="skills",
        hold=3,
        episodes=4,
        probe_episodes=2,
        plateau=sc.PlateauConfig(latest=2),
        updates=2,
        policy=SMALL,
        critic=SMALL,
        learner=sc.TD3Config(batch_size=8, network=network),
        **learner("mappo"),
    )

    def look(state):
        team, seen = algorithm.team(state), jnp.ones(5)
        return {
            "choice": episodes_of(algorithm, state, 30)[1].choice,
            "networks": state.learner.policies,
            "team's": team.policies,
            "outputs": jax.vmap(lambda network: network(seen, jnp.zeros(0))[0])(team.policies),
        }

    return algorithm, *trained(algorithm, 3, look)


def test_agents_choose_among_the_skills_of_their_type_and_keep_them() -> None:
    algorithm, found, metrics = choosing_skills()
    assert algorithm.choices() == SKILLS
    choice = np.asarray(found["choice"])
    assert set(choice[:, :, :2].ravel()) == {0, 1}
    assert set(choice[:, :, 2].ravel()) == {2, 3, 4}
    for world in range(30):
        for agent in range(3):
            changes = np.flatnonzero(np.diff(choice[:, world, agent])) + 1
            assert (np.diff([0, *changes]) >= 3).all()
    # 4 episodes of the team and 2 of each of 5 skills, of 12 steps: all count. Then no skill learns any more.
    assert metrics["environment_steps"].tolist() == [14 * 12, 2 * 14 * 12, (14 + 14 + 4) * 12]
    assert {"return_scout/left", "critic_loss_hauler/drop", "critic_loss", "policy_loss"} <= set(metrics)


def test_skills_that_have_stopped_are_probed_no_more() -> None:
    algorithm, _, metrics = choosing_skills()
    agents, steps = algorithm.env.n_agents, metrics["environment_steps"]
    # Nor is anything of them kept.
    np.testing.assert_array_equal(metrics["transitions_held"], steps * agents)
    for skill in SKILLS:
        assert metrics[f"stopped_at_{skill}"].tolist() == [-1, 2, 2]
        first, second, third = (float(value) for value in metrics[f"return_{skill}"])
        # What stands is what had been measured, smoothed over generations.
        kept = algorithm.config.plateau.smoothing
        assert third == pytest.approx(kept * first + (1 - kept) * second, rel=1e-6)


def test_a_skill_is_probed_as_long_as_it_learns() -> None:
    """Not until all others have stopped."""
    algorithm = sc.MAPPO(Toy(), choose="skills", episodes=4, probe_episodes=2)
    state = jax.jit(algorithm.init)(jax.random.key(0))
    stopped = jnp.where(jnp.arange(len(Toy().skills)) == 1, 3, -1)
    skills = dataclasses.replace(
        state.skills, plateau=dataclasses.replace(state.skills.plateau, stopped_at=stopped)
    )
    state = dataclasses.replace(state, skills=skills)
    _, lived = jax.jit(algorithm._live)(state, *jax.random.split(jax.random.key(1)))
    lives = np.asarray(lived.mask).any(0)
    assert lives.tolist() == [True] * 4 + [index not in (2, 3) for index in range(2 * len(stopped))]


def test_types_share_a_policy_each() -> None:
    _, found, _ = choosing_skills()
    assert jax.tree.leaves(found["networks"])[0].shape[0] == 2
    assert jax.tree.leaves(found["team's"])[0].shape[0] == 3
    outputs = np.asarray(found["outputs"])
    np.testing.assert_array_equal(outputs[0], outputs[1])
    assert (outputs[0] != outputs[2]).any()


def test_learners_get_what_was_decided_paid_and_seen() -> None:
    algorithm = sc.MAPPO(Toy(), choose="skills", reward="push+turn", hold=2, episodes=8, probe_episodes=1)
    state = jax.jit(algorithm.init)(jax.random.key(0))
    keys = jax.random.split(jax.random.key(1))
    _, lived = jax.jit(lambda s, a, b: algorithm._live(s, a, b))(state, *keys)
    own = lived.worlds(slice(8))
    experience = algorithm._experience(own)
    mask = np.asarray(own.mask)
    assert 8 < mask.sum() < mask.size
    np.testing.assert_array_equal(np.asarray(experience.taken)[mask], np.asarray(own.choice)[mask])
    paid = np.asarray(own.local_rewards)[..., [1, 3]].sum(-1)
    np.testing.assert_allclose(np.asarray(experience.reward)[mask], paid[mask])
    np.testing.assert_array_equal(experience.mask, mask)
    assert not np.asarray(experience.decides)[1].all()
    # Probes come after the team's own worlds, skill by skill.
    assert lived.choice[0, 8:].T.tolist() == [[0, 1, 2, 3]] * 3


def test_difference_rewards_are_each_agents_own_and_no_skill() -> None:
    env = sc.make("rover-t2-c2", episode_length=6, activation_distance=9.0)
    algorithm = sc.MAPPO(env, choose="skills", reward="D", episodes=4, probe_episodes=1, updates=2)
    assert "D" not in algorithm.choices()
    _, metrics = jax.eval_shape(lambda key: algorithm.step(algorithm.init(key)), jax.random.key(0))
    assert "return_D" not in metrics
    with pytest.raises(sc.UserError, match=r"reward = D needs counterfactual"):
        sc.IPPO(Toy(), reward="D")


def test_a_team_explores_while_it_learns_and_not_when_it_is_scored() -> None:
    algorithm = sc.COMA(Picking(), choose="actions", episodes=8, coma=sc.COMALearnerConfig(first_floor=0.9))
    state = jax.jit(algorithm.init)(jax.random.key(0))
    assert float(algorithm._learner.floor(state.learner)) == pytest.approx(0.9)
    assert float(algorithm.team(state).floor) == 0


@pytest.mark.parametrize(
    ("kind", "fields", "expected"),
    [
        ("MAPPOConfig", {"choose": "skill"}, "unknown choose 'skill'; valid, nearest first: skills, actions"),
        ("MAPPOConfig", {"hold": 0}, "hold = 0: give at least 1"),
        ("MAPPOConfig", {"hold": 2}, "hold = 2: skills are held, not actions; set choose to skills"),
        ("MAPPOConfig", {"episodes": 0}, "episodes = 0: give at least 1"),
        (
            "MAPPOConfig",
            {"episodes": 6},
            "ppo.minibatches = 4: does not divide episodes = 6; give a divisor of it",
        ),
    ],
)
def test_refuses_what_cannot_be_meant(kind: str, fields: dict[str, Any], expected: str) -> None:
    assert refusal(getattr(unhooked(ppo), kind), **fields) == expected


def test_refuses_what_the_world_has_not() -> None:
    with pytest.raises(
        sc.UserError, match=r"coma: compares each choice .* toy are continuous; set choose to"
    ):
        sc.COMA(Toy(), choose="actions")
    with pytest.raises(sc.UserError, match=r"unknown reward 'pus'; valid, nearest first: push"):
        sc.MAPPO(Toy(), reward="pus")
    with pytest.raises(sc.UserError, match=r"probe_episodes = 3: above episodes = 2"):
        sc.MAPPO(Toy(), choose="skills", episodes=2, ppo=sc.PPOConfig(minibatches=2))


def test_what_is_said_of_skills_is_kept_only_where_they_are_chosen() -> None:
    assert "learner" in sc.MAPPO(Toy()).config.unused(Toy())
    assert sc.MAPPO(Toy(), choose="skills").config.unused(Toy()) == {"dqn"}
    assert on_policy.OnPolicyConfig().choose == "actions"
