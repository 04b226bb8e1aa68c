"""What a team does with its selectors and the skills that all its agents share."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from oracles.rover_cases import quick_jit
from skillcrew.policies.actor import Actor
from skillcrew.policies.memory import PolicyConfig
from skillcrew.policies.selector import Selector
from skillcrew.policies.team import FixedChoiceTeam, SkillTeam, Team, apply_skills

AGENTS, SKILLS, OBSERVATION, ACTION = 5, 3, 4, 2
NETWORK = PolicyConfig(hidden=(6,))


@pytest.fixture(scope="module")
def team() -> SkillTeam:
    def create(key):
        selectors = jax.vmap(lambda k: Selector.create(k, OBSERVATION, SKILLS, NETWORK))
        skills = jax.vmap(lambda k: Actor.create(k, OBSERVATION, ACTION, NETWORK))
        return SkillTeam(
            selectors(jax.random.split(key, AGENTS)), skills(jax.random.split(key, SKILLS)), AGENTS
        )

    return quick_jit(create)(jax.random.key(0))


@pytest.fixture(scope="module")
def observation():
    return jax.random.normal(jax.random.key(1), (AGENTS, OBSERVATION))


def at(module, index: int):
    return jax.tree.map(lambda leaf: leaf[index], module)


def test_action_is_that_of_the_chosen_skill(team, observation) -> None:
    choice = jnp.array([2, 0, 1, 1, 0], jnp.int32)
    actions = apply_skills(team.skills, observation, choice)
    for agent in range(AGENTS):
        expected = at(team.skills, int(choice[agent]))(observation[agent])
        np.testing.assert_allclose(actions[agent], expected, rtol=1e-5, atol=1e-6)


def test_each_agent_has_a_selector_of_its_own_and_skills_are_shared(team, observation) -> None:
    same = jnp.tile(observation[:1], (AGENTS, 1))
    for seen in (observation, same):
        action, memory, choice = team.act(seen, team.initial_memory(), jax.random.key(2))
        assert memory.shape == team.initial_memory().shape == (AGENTS, 0)
        expected = [int(at(team.selectors, agent)(seen[agent], memory[agent])[0]) for agent in range(AGENTS)]
        assert choice.tolist() == expected
        assert len(set(expected)) > 1
        for agent in range(AGENTS):
            np.testing.assert_allclose(
                action[agent], at(team.skills, expected[agent])(seen[agent]), rtol=1e-5, atol=1e-6
            )


def test_a_fixed_choice_is_every_agents_choice(team, observation) -> None:
    fixed = FixedChoiceTeam(jnp.int32(2), team.skills, AGENTS)
    action, _, choice = fixed.act(observation, fixed.initial_memory(), jax.random.key(3))
    assert choice.tolist() == [2] * AGENTS
    np.testing.assert_allclose(action, jax.vmap(at(team.skills, 2))(observation), rtol=1e-5, atol=1e-6)


def test_both_are_teams(team) -> None:
    assert isinstance(team, Team)
    assert isinstance(FixedChoiceTeam(jnp.int32(0), team.skills, AGENTS), Team)
