"""Agents dealt out to their skills in blocks, against each agent's skill applied on its own."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from skillcrew.policies import dispatch
from skillcrew.policies.actor import Actor
from skillcrew.policies.dispatch import BLOCK, apply_skills
from skillcrew.policies.network import NetworkConfig

SKILLS, OBSERVATION, ACTION = 5, 4, 3
apply = jax.jit(apply_skills)


def skills_of(key) -> Actor:
    create = jax.vmap(lambda k: Actor.create(k, OBSERVATION, ACTION, NetworkConfig((6,), "sqrt")))
    return create(jax.random.split(key, SKILLS))


SKILL_SET = skills_of(jax.random.key(0))


def one_by_one(skills: Actor, observation, choice) -> np.ndarray:
    """Each row by its own skill, in NumPy."""
    (first, last), (bias, last_bias) = skills.network.weights, skills.network.biases
    actions = []
    for seen, skill in zip(np.asarray(observation), np.asarray(choice), strict=True):
        scaled = 2 * np.sign(seen) * np.sqrt(np.abs(seen))
        hidden = np.maximum(scaled @ np.asarray(first[skill]) + np.asarray(bias[skill]), 0)
        actions.append(np.tanh(hidden @ np.asarray(last[skill]) + np.asarray(last_bias[skill])))
    return np.array(actions)


def drawn(agents: int, seed: int = 1):
    key_seen, key_choice = jax.random.split(jax.random.key(seed))
    observation = jax.random.normal(key_seen, (agents, OBSERVATION))
    return observation, jax.random.randint(key_choice, (agents,), 0, SKILLS, jnp.int32)


@pytest.mark.parametrize("agents", [1, BLOCK // 2, BLOCK // 2 + 1, BLOCK, 3 * BLOCK + 7])
def test_every_agent_acts_by_its_own_skill(agents: int) -> None:
    observation, choice = drawn(agents)
    expected = one_by_one(SKILL_SET, observation, choice)
    np.testing.assert_allclose(apply(SKILL_SET, observation, choice), expected, rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("skill", [0, SKILLS - 1])
def test_all_may_choose_the_same_skill_and_nobody_some(skill: int) -> None:
    observation, _ = drawn(2 * BLOCK)
    choice = jnp.full(2 * BLOCK, skill, jnp.int32)
    expected = one_by_one(SKILL_SET, observation, choice)
    np.testing.assert_allclose(apply(SKILL_SET, observation, choice), expected, rtol=1e-4, atol=1e-5)


def test_worlds_and_teams_are_dealt_out_together(monkeypatch) -> None:
    sizes = []
    by_blocks = dispatch._by_blocks

    def counted(skills, observation, choice):
        sizes.append(len(choice))
        return by_blocks(skills, observation, choice)

    monkeypatch.setattr(dispatch, "_by_blocks", counted)
    teams, worlds, agents = 3, 20, 2
    observation, choice = drawn(teams * worlds * agents)
    in_worlds = jax.vmap(jax.vmap(apply_skills, in_axes=(None, 0, 0)), in_axes=(None, 0, 0))
    actions = jax.jit(in_worlds)(
        SKILL_SET,
        observation.reshape(teams, worlds, agents, -1),
        choice.reshape(teams, worlds, agents),
    )
    expected = one_by_one(SKILL_SET, observation, choice).reshape(teams, worlds, agents, -1)
    np.testing.assert_allclose(actions, expected, rtol=1e-4, atol=1e-5)
    assert sizes[-1] == teams * worlds * agents


@pytest.mark.parametrize("agents", [3, BLOCK + 9])
def test_each_seed_has_skills_of_its_own(agents: int) -> None:
    seeds = 3
    skills = jax.vmap(skills_of)(jax.random.split(jax.random.key(4), seeds))
    observation, choice = drawn(agents)
    actions = jax.jit(jax.vmap(apply_skills, in_axes=(0, None, 0)))(
        skills, observation, jnp.stack([(choice + seed) % SKILLS for seed in range(seeds)])
    )
    for seed in range(seeds):
        own = jax.tree.map(lambda leaf, seed=seed: leaf[seed], skills)
        expected = one_by_one(own, observation, (choice + seed) % SKILLS)
        np.testing.assert_allclose(actions[seed], expected, rtol=1e-4, atol=1e-5)
