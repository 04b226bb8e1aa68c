"""One generation of MADyS against loops, and what may flow between evolution and learning.

All numbers differ: 2 agents, 3 types, 4 skills (of 8, in an order of their own), 5 episodes, 7 teams.
"""

import dataclasses
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from oracles.generation import Lived
from skillcrew.algorithms import skill_learning, team_search
from skillcrew.algorithms import skill_teams as module
from skillcrew.algorithms.madys import MADyS, MADySConfig
from skillcrew.algorithms.skill_teams import SkillTeamsState
from skillcrew.envs.rover.config import RoverConfig
from skillcrew.envs.rover.world import RoverDomain
from skillcrew.errors import UserError
from skillcrew.evolution.genetic import EvolutionConfig
from skillcrew.learners.plateau import PlateauConfig
from skillcrew.learners.td3 import TD3Config
from skillcrew.policies.network import NetworkConfig
from skillcrew.policies.population import GenomeCodec
from skillcrew.policies.selector import Selector, SelectorConfig
from skillcrew.rollout import Trajectories, rollout

AGENTS, SKILLS, EPISODES, TEAMS, PROBES = 2, 4, 5, 7, 3
DISCOUNT = 0.8
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
CONFIG = MADySConfig(
    population=TEAMS,
    episodes=EPISODES,
    probe_episodes=PROBES,
    fitness_discount=DISCOUNT,
    updates=4,
    exploration_noise=0.0,
    buffer_capacity=1500,
    skills=NAMES,
    selector=SelectorConfig((6,), "sqrt"),
    evolution=EvolutionConfig(elites=2),
    learner=TD3Config(batch_size=16, network=NetworkConfig((5,), "sqrt")),
    plateau=PlateauConfig(window=4, earliest=0),
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
MADYS = MADyS(ENV, CONFIG)
TRACES = []


@jax.jit
def compiled(state: SkillTeamsState, local_factor: Any, team_factor: Any) -> Any:
    TRACES.append(1)
    return MADyS(Poisoned(local_factor, team_factor), CONFIG).step(state)


def generation(state: SkillTeamsState, local_factor: float = 1.0, team_factor: float = 0.0) -> Any:
    return compiled(state, local_factor, team_factor)


init = jax.jit(MADYS.init)


@pytest.fixture(scope="module")
def run() -> tuple[list[SkillTeamsState], list[dict[str, Any]]]:
    """States after 0, 1 and 2 generations, and the metrics of the two."""
    states, metrics = [init(jax.random.key(11))], []
    for _ in range(2):
        state, measured = generation(states[-1])
        states.append(state)
        metrics.append(jax.device_get(measured))
    return states, metrics


@pytest.fixture(scope="module")
def before(run) -> SkillTeamsState:
    return run[0][0]


@pytest.fixture(scope="module")
def after(run) -> SkillTeamsState:
    return run[0][1]


@pytest.fixture(scope="module")
def lived(before) -> Lived:
    """The first generation again, in loops. Its start worlds come from the state's key."""
    create = GenomeCodec(
        lambda key: Selector.create(key, ENV.observation_size, SKILLS, CONFIG.selector), AGENTS
    )
    selectors = jax.vmap(create.decode)(before.search.genomes)
    start_keys = jax.random.split(jax.random.split(before.key, 5)[1], EPISODES)
    return Lived(ENV, selectors, before.skills.learners.target_actor, start_keys, PROBES)


@pytest.fixture(scope="module")
def fitness(lived) -> np.ndarray:
    def team_return(episode) -> float:
        return sum(DISCOUNT**time * reward for time, reward in enumerate(episode.team_reward))

    return np.array([np.mean([team_return(episode) for episode in team]) for team in lived.teams])


def rows(state: SkillTeamsState, generation_start: int = 0) -> dict[str, np.ndarray]:
    """The buffer's transitions, by field."""
    held = np.asarray(state.skills.experience.experience[0])[
        generation_start : int(state.skills.experience.current_index)
    ]
    size = ENV.observation_size
    names = ("observation", "action", "next_observation", "local_rewards", "team_reward", "terminated")
    ends = np.cumsum([size, ENV.action_size, size, SKILLS, 1])
    return dict(zip(names, np.split(held, ends, axis=1), strict=True))


def identical(one: Any, other: Any) -> bool:
    pairs = zip(jax.tree.leaves(one), jax.tree.leaves(other), strict=True)
    return all(np.array_equal(a, b) for a, b in pairs)


def skill(tree: Any, index: int) -> Any:
    return jax.tree.map(lambda leaf: leaf[index], tree)


def with_plateau(state: SkillTeamsState, **fields: Any) -> SkillTeamsState:
    plateau = dataclasses.replace(state.skills.plateau, **fields)
    return dataclasses.replace(state, skills=dataclasses.replace(state.skills, plateau=plateau))


# Rollout and fitness


def test_episodes_end_at_different_times_and_teams_differ(lived, fitness) -> None:
    assert len({len(episode) for team in lived.teams for episode in team}) > 1
    assert len(np.unique(fitness)) > 2


def test_fitness_is_the_mean_discounted_team_return_over_the_same_episodes_for_all(run, fitness) -> None:
    assert run[1][0]["fitness_best"] == pytest.approx(fitness.max(), rel=1e-5)
    assert run[1][0]["fitness_mean"] == pytest.approx(fitness.mean(), rel=1e-5)


def test_environment_steps_are_the_lived_ones_probes_included_and_add_up(run, lived) -> None:
    first, second = run[1]
    assert first["environment_steps"] == lived.steps()
    assert second["environment_steps"] > first["environment_steps"]
    # As many as there are transitions of each agent.
    assert second["transitions_held"] == AGENTS * second["environment_steps"]
    assert int(run[0][2].generation) == 2


@pytest.mark.parametrize("field", ["observation", "action", "next_observation"])
def test_buffer_holds_every_agents_lived_transitions(after, lived, field: str) -> None:
    expected = [getattr(episode, field)[time, agent] for episode, time, agent in lived.in_buffer_order()]
    np.testing.assert_allclose(rows(after)[field], expected, rtol=1e-4, atol=1e-4)


def test_buffer_holds_the_chosen_skills_rewards_in_their_order(after, lived) -> None:
    columns = [ENV.skills.index(name) for name in NAMES]
    expected = [
        episode.local_rewards[time, agent, columns] for episode, time, agent in lived.in_buffer_order()
    ]
    np.testing.assert_allclose(rows(after)["local_rewards"], expected, rtol=1e-4, atol=1e-4)


@pytest.mark.parametrize("field", ["team_reward", "terminated"])
def test_buffer_holds_team_reward_and_end_for_every_agent(after, lived, field: str) -> None:
    expected = [getattr(episode, field)[time] for episode, time, _ in lived.in_buffer_order()]
    np.testing.assert_allclose(rows(after)[field][:, 0], expected, rtol=1e-5)
    assert sum(expected) > 0


def test_exploration_noise_lasts_until_all_skills_have_stopped(before, monkeypatch) -> None:
    received = []

    def recorded(env, lineup, key, noise, kept):
        received.append(noise)
        return rollout(env, lineup, key, noise, kept)

    @jax.jit
    def noise(state: SkillTeamsState) -> Any:
        """What a step hands to the rollout; all else it computes is dropped by the compiler."""
        MADyS(ENV, CONFIG, exploration_noise=0.25).step(state)
        return received[-1]

    monkeypatch.setattr(module, "rollout", recorded)
    for stopped_at, expected in (([-1, -1, -1, -1], 0.25), ([3, 1, -1, 2], 0.25), ([3, 1, 1, 2], 0.0)):
        assert float(noise(with_plateau(before, stopped_at=jnp.array(stopped_at, jnp.int32)))) == expected


def test_start_worlds_differ_between_episodes_and_generations(run, lived) -> None:
    pois = np.array([world.poi_position for world in lived.worlds])
    assert len(np.unique(pois)) == pois.size
    held = int(run[0][1].skills.experience.current_index)
    starts = [rows(run[0][g], begin)["observation"] for g, begin in ((1, 0), (2, held))]
    first, second = (start[: TEAMS * EPISODES * AGENTS].reshape(TEAMS, EPISODES, -1) for start in starts)
    for start in (first, second):
        assert (start == start[:1]).all()
        assert len(np.unique(start[0], axis=0)) == EPISODES
    assert not np.isclose(first[0], second[0]).all(1).any()


def test_only_the_recorded_episodes_enter_the_buffer_and_all_count_for_fitness(
    before, run, lived, monkeypatch
) -> None:
    # Learning is another test's, and takes long to compile.
    monkeypatch.setattr(skill_learning, "train_skills", lambda key, learner, learners, *rest: (learners, {}))
    recorded = 2
    state, measured = jax.jit(MADyS(ENV, CONFIG, recorded_episodes=recorded).step)(before)
    kept = [episode for team in lived.teams for episode in team[:recorded]]
    kept += [episode for probe in lived.probes for episode in probe]
    for field in ("observation", "action"):
        expected = [
            getattr(episode, field)[time, agent]
            for episode, time, agent in lived.in_buffer_order()
            if any(episode is one for one in kept)
        ]
        np.testing.assert_allclose(rows(state)[field], expected, rtol=1e-4, atol=1e-4)
    assert int(measured["transitions_held"]) == AGENTS * sum(len(episode) for episode in kept)
    for name in ("fitness_best", "fitness_mean", "environment_steps"):
        assert float(measured[name]) == pytest.approx(float(run[1][0][name]), rel=1e-6)
    # The returns are those of the probes, wherever these stand.
    for name in NAMES:
        assert float(measured[f"return_{name}"]) == pytest.approx(run[1][0][f"return_{name}"], rel=1e-5)


def test_a_buffer_need_hold_only_what_is_recorded() -> None:
    # 2 episodes of 7 teams and 4 · 3 probes, of 6 steps of 2 agents each.
    smallest = (2 * TEAMS + SKILLS * PROBES) * 6 * AGENTS
    MADyS(ENV, CONFIG, recorded_episodes=2, buffer_capacity=smallest)
    with pytest.raises(UserError, match=rf"buffer_capacity = {smallest - 1}: .* {smallest} transitions"):
        MADyS(ENV, CONFIG, recorded_episodes=2, buffer_capacity=smallest - 1)


# Evolution


def test_a_strategy_moves_one_selector_with_memory_that_all_agents_share(monkeypatch) -> None:
    monkeypatch.setattr(skill_learning, "train_skills", lambda key, learner, learners, *rest: (learners, {}))
    madys = MADyS(
        ENV,
        CONFIG,
        population=8,
        evolver="strategy",
        selector=SelectorConfig(hidden=(6,), memory=3, sharing="team"),
    )
    first = jax.jit(madys.init)(jax.random.key(2))
    after, measured = jax.jit(madys.step)(first)
    assert after.search.noise.shape[0] == 4
    assert not identical(after.search.mean, first.search.mean)
    team = madys.team(after)
    assert team.selectors.network.unit.weight_hh.shape == (1, 9, 3)
    # The champion is the mean of the cloud, one network for all.
    genes = np.concatenate([np.asarray(leaf).ravel() for leaf in jax.tree.leaves(team.selectors)])
    np.testing.assert_array_equal(genes, after.search.mean)
    assert team.initial_memory().shape == (AGENTS, 3)
    assert float(measured["champion_fitness"]) == pytest.approx(float(measured["fitness_mean"]))
    assert 0 < measured["fitness_mean"] <= measured["fitness_best"]


def test_the_champion_is_the_fittest_with_the_skills_as_they_are_now(before, after, run, fitness) -> None:
    fittest = before.search.genomes[int(fitness.argmax())]
    np.testing.assert_array_equal(after.search.genomes[0], fittest)
    team = MADYS.team(after)
    genes = np.concatenate(
        [np.asarray(leaf).reshape(AGENTS, -1) for leaf in jax.tree.leaves(team.selectors)], 1
    )
    np.testing.assert_array_equal(genes.ravel(), fittest)
    assert identical(team.skills, after.skills.learners.target_actor)
    assert run[1][0]["champion_fitness"] == pytest.approx(fitness.max(), rel=1e-5)


def test_local_rewards_never_reach_evolution(before, after, run) -> None:
    other, measured = generation(before, 3.0, 0.0)
    assert identical(other.search, after.search)
    assert measured["fitness_mean"] == run[1][0]["fitness_mean"]
    # They do reach the learners.
    assert not identical(other.skills.learners, after.skills.learners)


def test_team_reward_never_reaches_the_learners(before, after) -> None:
    other, _ = generation(before, 1.0, -1000.0)
    assert identical(other.skills.learners, after.skills.learners)
    assert identical(other.skills.plateau, after.skills.plateau)
    # It does reach evolution.
    assert not identical(other.search.genomes, after.search.genomes)


# Skills


def test_returns_are_of_each_skills_own_probes(run, lived) -> None:
    discount = CONFIG.learner.discount
    for k, name in enumerate(NAMES):
        column = ENV.skills.index(name)
        returns = [
            sum(discount ** (u - t) * episode.local_rewards[u, agent, column] for u in range(t, len(episode)))
            for episode in lived.probes[k]
            for agent in range(AGENTS)
            for t in range(len(episode))
        ]
        assert run[1][0][f"return_{name}"] == pytest.approx(np.mean(returns), rel=1e-4)


@pytest.mark.parametrize("task_ends_skills", [False, True])
def test_returns_end_with_the_task_only_where_values_do(task_ends_skills: bool) -> None:
    """The second probe of each skill is done after two steps; what it was paid last goes on, or not."""
    config = dataclasses.replace(CONFIG, task_ends_skills=task_ends_skills)
    learning = skill_learning.SkillLearning(ENV, config)
    time, worlds = ENV.episode_length, SKILLS * PROBES
    rewards = np.random.default_rng(0).normal(size=(time, worlds, AGENTS, SKILLS)).astype(np.float32)
    is_second = np.arange(worlds) % PROBES == 1
    lived = (np.arange(time)[:, None] < 2) | ~is_second
    nothing = jnp.zeros((time, worlds, AGENTS, 1))
    trajectories = Trajectories(
        team_reward=jnp.zeros((time, worlds)),
        terminated=jnp.zeros((time, worlds), bool).at[1].set(is_second),
        mask=jnp.asarray(lived),
        observation=nothing,
        action=nothing,
        next_observation=nothing,
        local_rewards=jnp.asarray(rewards),
        choice=jnp.zeros((time, worlds, AGENTS), jnp.int32),
    )
    if not task_ends_skills:
        rewards[2:, is_second] = rewards[1, is_second]
        lived[:] = True
    for skill_index, measured in enumerate(learning._returns(trajectories)):
        returns = [
            sum(CONFIG.learner.discount ** (u - t) * rewards[u, world, agent, skill_index] for u in steps[n:])
            for world in range(skill_index * PROBES, (skill_index + 1) * PROBES)
            for agent in range(AGENTS)
            for steps in [np.flatnonzero(lived[:, world])]
            for n, t in enumerate(steps)
        ]
        assert float(measured) == pytest.approx(np.mean(returns), rel=1e-4)


def test_finalists_race_with_the_noise_that_all_others_had(monkeypatch) -> None:
    """Noisy and noise-free returns are not of one kind. Looked at while the step is traced."""
    noises: list[Any] = []
    drawn: list[Any] = []

    def spy(*inputs, **named):
        noises.append(inputs[3])
        return rollout(*inputs, **named)

    def noise(self, learning):
        drawn[:] = drawn or [jnp.where(learning, self.config.exploration_noise, 0.0)]
        return drawn[0]

    for user in (module, team_search):
        monkeypatch.setattr(user, "rollout", spy)
    monkeypatch.setattr(skill_learning.SkillLearning, "noise", noise)
    raced = MADyS(ENV, dataclasses.replace(CONFIG, race=team_search.RaceConfig(2, 3), exploration_noise=0.3))
    jax.eval_shape(lambda key: raced.step(raced.init(key)), jax.random.key(0))
    assert len(noises) == 2
    assert noises[0] is noises[1] is drawn[0]


def test_every_skill_learns(before, after) -> None:
    for index in range(SKILLS):
        assert not identical(
            skill(before.skills.learners.actor, index), skill(after.skills.learners.actor, index)
        )


def test_stopped_skills_stay_while_the_others_and_evolution_go_on(run) -> None:
    state = with_plateau(run[0][1], stopped_at=jnp.array([1, -1, -1, 1], jnp.int32))
    stopped, measured = generation(state)
    moved = [
        not identical(skill(stopped.skills.learners, k), skill(state.skills.learners, k))
        for k in range(SKILLS)
    ]
    assert moved == [False, True, True, False]
    assert [int(measured[f"stopped_at_{name}"]) for name in NAMES] == [1, -1, -1, 1]
    assert [bool(np.isnan(measured[f"critic_loss_{name}"])) for name in NAMES] == [True, False, False, True]
    assert identical(stopped.search, run[0][2].search)


def test_once_all_skills_have_stopped_none_changes(after) -> None:
    state = with_plateau(after, stopped_at=jnp.full(SKILLS, 1, jnp.int32))
    stopped, _ = generation(state)
    assert identical(stopped.skills.learners, state.skills.learners)
    assert not identical(stopped.search.genomes, state.search.genomes)


def test_a_skill_stops_at_the_generation_that_its_metric_names(after) -> None:
    # Skill 2 has waited for one generation less than the window, and its best is out of reach.
    state = with_plateau(
        after,
        best=jnp.array([-1e6, -1e6, 1e6, -1e6]),
        waited=jnp.full(SKILLS, CONFIG.plateau.window - 1, jnp.int32),
    )
    stopped, measured = generation(state)
    assert [int(measured[f"stopped_at_{name}"]) for name in NAMES] == [-1, -1, 2, -1]
    moved = [
        not identical(skill(stopped.skills.learners, k), skill(state.skills.learners, k))
        for k in range(SKILLS)
    ]
    assert moved == [True, True, False, True]


# Programs


def test_a_step_is_traced_once_for_all_generations(run) -> None:
    generation(run[0][2])
    assert len(TRACES) == 1


def numbers(tree: Any) -> list[np.ndarray]:
    """The leaves, keys as the numbers that they are made of."""
    leaves = jax.tree.leaves(tree)
    is_key = [jnp.issubdtype(leaf.dtype, jax.dtypes.prng_key) for leaf in leaves]
    return [
        np.asarray(jax.random.key_data(leaf) if key else leaf)
        for leaf, key in zip(leaves, is_key, strict=True)
    ]


def test_seeds_side_by_side_equal_each_alone(run) -> None:
    keys = jnp.stack([jax.random.key(seed) for seed in (11, 5, 3)])
    together, measured = jax.jit(lambda keys: jax.vmap(MADYS.step)(jax.vmap(MADYS.init)(keys)))(keys)
    for lane, seed in enumerate((11, 5, 3)):
        state, metrics = generation(init(jax.random.key(seed)))
        one = jax.tree.map(lambda leaf, lane=lane: leaf[lane], (together, measured))
        for a, b in zip(numbers(one), numbers((state, metrics)), strict=True):
            np.testing.assert_allclose(a, b, rtol=2e-3, atol=2e-3)


def test_choices_are_the_skills_that_were_asked_for() -> None:
    assert MADYS.choices() == NAMES
    assert MADyS(ENV).choices() == ENV.skills
