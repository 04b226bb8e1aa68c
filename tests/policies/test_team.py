"""What a team does with its selectors and the skills that all its agents share."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import stats

from skillcrew.policies.actor import Actor
from skillcrew.policies.memory import PolicyConfig
from skillcrew.policies.selector import Selector
from skillcrew.policies.team import FixedChoiceTeam, SkillTeam, Team, WanderingTeam, apply_skills

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

    return jax.jit(create)(jax.random.key(0))


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


# Wandering: random choices that last


WORLDS, STEPS, CHANGE = 900, 7, 0.3


def remembering(team: SkillTeam) -> SkillTeam:
    """The same skills under selectors with memory, so that a lost memory would be seen."""
    config = PolicyConfig(hidden=(6,), memory=2)
    create = jax.vmap(lambda key: Selector.create(key, OBSERVATION, SKILLS, config))
    return SkillTeam(create(jax.random.split(jax.random.key(8), AGENTS)), team.skills, AGENTS)


def live(team: Team, worlds: int):
    """Actions and choices [steps, worlds, agents …] of a team on observations of its own."""
    seen = 3 * jax.random.normal(jax.random.key(5), (STEPS, worlds, AGENTS, OBSERVATION))
    keys = jax.random.split(jax.random.key(6), (STEPS, worlds))

    def one_step(memory, inputs):
        action, memory, choice = jax.vmap(team.act)(inputs[0], memory, inputs[1])
        return memory, (action, choice)

    memory = jax.tree.map(lambda leaf: jnp.stack([leaf] * worlds), team.initial_memory())
    return seen, jax.lax.scan(one_step, memory, (seen, keys))[1]


@pytest.fixture(scope="module")
def wandered(team):
    """Observations, actions and choices of exploring teams."""
    exploring = WanderingTeam(remembering(team), jnp.array(True), CHANGE)
    return jax.device_get(jax.jit(lambda: live(exploring, WORLDS))())


def test_exploring_agents_choose_each_skill_equally_often(wandered) -> None:
    choice = wandered[1][1]
    for time in (0, STEPS - 1):
        counts = np.bincount(choice[time].ravel(), minlength=SKILLS)
        assert len(counts) == SKILLS
        assert stats.chisquare(counts).pvalue > 1e-3


def test_exploring_agents_keep_a_choice_for_a_while(wandered) -> None:
    choice = wandered[1][1]
    # What is drawn anew is one time in SKILLS the same again.
    kept = 1 - CHANGE * (SKILLS - 1) / SKILLS
    same = choice[1:] == choice[:-1]
    assert same.mean() == pytest.approx(kept, abs=0.01)
    # Each agent changes by itself, whatever the others do.
    together = np.corrcoef(same.reshape(-1, AGENTS).T) - np.eye(AGENTS)
    assert np.abs(together).max() < 0.05
    # A change leads to any of the others.
    changed = choice[1:][~same] - choice[:-1][~same]
    assert stats.chisquare(np.bincount(changed % SKILLS, minlength=SKILLS)[1:]).pvalue > 1e-3


def test_exploring_agents_act_by_the_skill_that_they_chose(team, wandered) -> None:
    seen, (action, choice) = wandered
    everything = jax.jit(jax.vmap(jax.vmap(Actor.__call__, (None, 0)), (0, None)))
    for world in range(4):
        by_skill = everything(team.skills, seen[2, world])
        expected = by_skill[choice[2, world], np.arange(AGENTS)]
        np.testing.assert_allclose(action[2, world], expected, rtol=1e-4, atol=1e-5)


def test_who_does_not_explore_acts_as_the_team_itself(team) -> None:
    own = remembering(team)
    resting = WanderingTeam(own, jnp.array(False), CHANGE)
    _, (action, choice) = jax.jit(lambda: live(resting, 3))()
    _, (expected_action, expected_choice) = jax.jit(lambda: live(own, 3))()
    assert choice.tolist() == expected_choice.tolist()
    np.testing.assert_allclose(action, expected_action, rtol=1e-5, atol=1e-6)
    assert len(np.unique(choice)) > 1
