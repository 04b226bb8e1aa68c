"""MFL: skills first, from agents that choose at random; then selectors, over skills that are frozen.

All numbers differ: 2 agents, 3 types, 4 skills (of 8, in an order of their own), 5 episodes, 7 teams.
"""

import dataclasses
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from skillcrew.algorithms import skill_teams as module
from skillcrew.algorithms.mfl import MFL, MFLConfig
from skillcrew.algorithms.skill_teams import SkillTeamsState
from skillcrew.algorithms.team_search import RaceConfig
from skillcrew.envs.rover.config import RoverConfig
from skillcrew.envs.rover.world import RoverDomain
from skillcrew.evolution.genetic import EvolutionConfig
from skillcrew.learners.plateau import PlateauConfig
from skillcrew.learners.td3 import TD3Config
from skillcrew.policies.network import NetworkConfig
from skillcrew.policies.population import GenomeCodec
from skillcrew.policies.selector import Selector, SelectorConfig
from skillcrew.rollout import rollout

AGENTS, SKILLS, EPISODES, TEAMS, PROBES = 2, 4, 5, 7, 3
WORLDS = TEAMS * EPISODES
BUDGET, CHANGE, NOISE = 1000, 0.4, 0.35
NAMES = ("go_to_poi_C", "go_away_from_poi_A", "go_to_agent", "go_to_poi_A")
WORLD = RoverConfig(
    n_agents=AGENTS,
    n_poi_types=3,
    world_size=5.0,
    episode_length=6,
    sensor_resolution=180,
    activation_distance=2.2,
    team_reward="fraction",
)
CONFIG = MFLConfig(
    population=TEAMS,
    episodes=EPISODES,
    probe_episodes=PROBES,
    updates=4,
    buffer_capacity=1500,
    skills=NAMES,
    selector=SelectorConfig((6,), "sqrt"),
    evolution=EvolutionConfig(elites=2),
    learner=TD3Config(batch_size=16, network=NetworkConfig((5,), "sqrt")),
    plateau=PlateauConfig(window=4, earliest=0),
    pretraining_steps=BUDGET,
    exploration_change=CHANGE,
    exploration_noise=NOISE,
)


class Poisoned(RoverDomain):
    """The Rover Domain with other rewards, by numbers that one compiled program takes as inputs."""

    def __init__(self, local_factor: Any, team_factor: Any):
        super().__init__(WORLD)
        self.local_factor, self.team_factor = local_factor, team_factor

    def step_worlds(self, state, action, keys):
        state, step = super().step_worlds(state, action, keys)
        return state, dataclasses.replace(
            step,
            local_rewards=self.local_factor * step.local_rewards,
            team_reward=step.team_reward + self.team_factor * state.position[0, 0],
        )


ENV = RoverDomain(WORLD)


@jax.jit
def generation(state: SkillTeamsState, local_factor: Any = 1.0, team_factor: Any = 0.0) -> Any:
    """A generation, and beside it what its rollout was given and what came out of it."""
    received = []

    def watched(env, lineup, key, noise, kept):
        told = rollout(env, lineup, key, noise, kept)
        received.append({"noise": noise, "episodes": told[0], "lived": told[1]})
        return told

    plain, module.rollout = module.rollout, watched
    try:
        state, metrics = MFL(Poisoned(local_factor, team_factor), CONFIG).step(state)
    finally:
        module.rollout = plain
    return state, metrics, received[-1]


def told(state: SkillTeamsState, steps: int) -> SkillTeamsState:
    """The same state after so many environment steps."""
    return dataclasses.replace(state, environment_steps=jnp.int32(steps))


def identical(one: Any, other: Any) -> bool:
    pairs = zip(jax.tree.leaves(one), jax.tree.leaves(other), strict=True)
    return all(np.array_equal(a, b) for a, b in pairs)


@pytest.fixture(scope="module")
def first() -> SkillTeamsState:
    return jax.jit(MFL(ENV, CONFIG).init)(jax.random.key(12))


@pytest.fixture(scope="module")
def pretrained(first) -> tuple[SkillTeamsState, dict[str, Any], dict[str, Any]]:
    """After the first generation."""
    return generation(first, 1.0, 0.0)


@pytest.fixture(scope="module")
def evolved(pretrained) -> tuple[SkillTeamsState, dict[str, Any], dict[str, Any]]:
    """After the next one, had the first used up all of the pre-training's steps."""
    return generation(told(pretrained[0], BUDGET), 1.0, 0.0)


def test_in_pretraining_every_skill_learns_and_the_population_waits(first, pretrained) -> None:
    after, metrics, _ = pretrained
    assert bool(metrics["pretraining"])
    assert identical(after.search, first.search)
    for skill in range(SKILLS):
        before, now = (
            jax.tree.map(lambda leaf, skill=skill: leaf[skill], s.skills.learners.actor)
            for s in (first, after)
        )
        assert not identical(before, now)
    assert all(np.isfinite(metrics[f"critic_loss_{name}"]) for name in NAMES)


def test_after_it_skills_stay_and_selectors_evolve(pretrained, evolved) -> None:
    before, (after, metrics, _) = pretrained[0], evolved
    assert not bool(metrics["pretraining"])
    assert identical(after.skills.learners, before.skills.learners)
    assert all(np.isnan(metrics[f"critic_loss_{name}"]) for name in NAMES)
    assert not identical(after.search.genomes, before.search.genomes)
    assert after.search.lineage.evaluations[0] == 1
    # Once more: a skill that is frozen stays so.
    again = generation(after, 1.0, 0.0)[0]
    assert identical(again.skills.learners, before.skills.learners)
    assert not identical(again.search.genomes, after.search.genomes)


@pytest.mark.parametrize("steps", [0, BUDGET - 1, BUDGET, BUDGET + 1])
def test_the_switch_is_at_the_first_generation_that_begins_beyond_the_budget(first, steps: int) -> None:
    after, metrics, _ = generation(told(first, steps), 1.0, 0.0)
    assert bool(metrics["pretraining"]) == (steps < BUDGET)
    assert identical(after.search, first.search) == (steps < BUDGET)
    assert identical(after.skills.learners, first.skills.learners) == (steps >= BUDGET)


def test_steps_of_pretraining_are_environment_steps(pretrained, evolved) -> None:
    for (_, metrics, seen), before in ((pretrained, 0), (evolved, BUDGET)):
        lived = int(np.asarray(seen["episodes"].mask).sum())
        # Of all teams and all probes.
        assert seen["episodes"].mask.shape == (WORLD.episode_length, WORLDS + SKILLS * PROBES)
        assert int(metrics["environment_steps"]) == before + lived


def test_noise_is_on_while_skills_are_trained_and_off_after_that(pretrained, evolved) -> None:
    assert float(pretrained[2]["noise"]) == pytest.approx(NOISE)
    assert float(evolved[2]["noise"]) == 0


def choices_of(generation_seen: dict[str, Any]) -> np.ndarray:
    """[time, worlds of teams, agents]"""
    return np.asarray(generation_seen["lived"].choice)[:, :WORLDS]


def test_in_pretraining_choices_are_random_and_last(pretrained) -> None:
    choice = choices_of(pretrained[2])
    counts = np.bincount(choice[0].ravel(), minlength=SKILLS)
    assert counts.min() > 0.5 * counts.mean()
    kept = 1 - CHANGE * (SKILLS - 1) / SKILLS
    assert (choice[1:] == choice[:-1]).mean() == pytest.approx(kept, abs=0.07)
    # Not by the teams: in the same world they would choose alike each time, and agents by what they see.
    assert len(np.unique(choice[0].reshape(TEAMS, EPISODES * AGENTS), axis=0)) == TEAMS


def test_after_it_choices_are_the_selectors(pretrained, evolved) -> None:
    codec = GenomeCodec(
        lambda key: Selector.create(key, ENV.observation_size, SKILLS, CONFIG.selector), AGENTS
    )
    selectors = jax.vmap(codec.decode)(pretrained[0].search.genomes)
    seen = evolved[2]["lived"].observation[:, :WORLDS]
    by_team = seen.reshape(-1, TEAMS, EPISODES, AGENTS, ENV.observation_size)

    def choose(selector, observation):
        return selector(observation, jnp.zeros(0))[0]

    over = jax.vmap(jax.vmap(choose))  # Teams, then agents.
    expected = jax.jit(jax.vmap(jax.vmap(over, (None, 1)), (None, 0)))(selectors, by_team)
    expected = np.asarray(expected).transpose(0, 2, 1, 3).reshape(-1, WORLDS, AGENTS)
    assert choices_of(evolved[2]).tolist() == expected.tolist()
    assert len(np.unique(expected)) > 1


def test_probes_use_one_skill_throughout(pretrained, evolved) -> None:
    expected = np.repeat(np.arange(SKILLS), PROBES)
    for _, _, seen in (pretrained, evolved):
        choice = np.asarray(seen["lived"].choice)[:, WORLDS:]
        assert (choice == expected[None, :, None]).all()


def test_team_reward_never_reaches_the_learners(first, pretrained) -> None:
    other = generation(first, 1.0, -1000.0)[0]
    assert identical(other.skills.learners, pretrained[0].skills.learners)
    assert identical(other.skills.plateau, pretrained[0].skills.plateau)


def test_local_rewards_never_reach_evolution(pretrained, evolved) -> None:
    state = told(pretrained[0], BUDGET)
    assert identical(generation(state, -3.0, 0.0)[0].search, evolved[0].search)
    # Team rewards do.
    assert not identical(generation(state, 1.0, -1000.0)[0].search, evolved[0].search)
    # Local ones reach the learners, before that.
    other = generation(told(pretrained[0], 0), -3.0, 0.0)[0]
    assert not identical(
        other.skills.learners, generation(told(pretrained[0], 0), 1.0, 0.0)[0].skills.learners
    )


def test_the_champion_acts_by_its_selectors(evolved) -> None:
    algorithm, state = MFL(ENV, CONFIG), evolved[0]
    team = algorithm.team(state)
    genes = np.concatenate(
        [np.asarray(leaf).reshape(AGENTS, -1) for leaf in jax.tree.leaves(team.selectors)], 1
    )
    np.testing.assert_array_equal(genes.ravel(), state.search.genomes[0])
    assert identical(team.skills, state.skills.learners.target_actor)
    assert algorithm.choices() == NAMES


def test_a_race_costs_steps_only_where_it_decides_who_breeds() -> None:
    """While skills are trained nobody breeds; after that its episodes count."""
    steps = {}
    for finalists in (0, 3):
        race = RaceConfig(finalists=finalists, episodes=4)
        algorithm = MFL(ENV, dataclasses.replace(CONFIG, race=race))
        step = jax.jit(algorithm.step)
        start = jax.jit(algorithm.init)(jax.random.key(5))
        trained = dataclasses.replace(start, environment_steps=jnp.asarray(BUDGET, jnp.int32))
        steps[finalists] = [int(step(state)[1]["environment_steps"]) for state in (start, trained)]
    assert steps[0][0] == steps[3][0]
    assert steps[0][1] < steps[3][1] <= steps[0][1] + 3 * 4 * WORLD.episode_length
