"""Difference rewards: what they are worth, what they ignore, and that learners are paid by them."""

import dataclasses
import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import skillcrew as sc
from skillcrew.credit.difference import Credited, credited, difference, difference_with_more
from skillcrew.errors import UserError

AGENTS, WORLDS, STEPS = 4, 60, 8


def rovers(n_agents: int = AGENTS, **options):
    fields = dict(spatial_coupling=2, world_size=6.0, team_reward="fraction", episode_length=STEPS)
    return sc.make("rover-t2-c2", n_agents=n_agents, **{**fields, **options})


def d_plus_plus(reward: float, without: float, more: list[float]) -> float:
    """The search for n as its authors write it down, one agent and one number at a time."""

    def with_helpers(n: int) -> float:
        return (more[n - 1] - reward) / n

    before = reward - without
    if with_helpers(len(more)) <= before:
        return before
    for n in range(1, len(more) + 1):
        now = with_helpers(n)
        if now < before:
            return before
        before = now
    return before


EIGHTHS = st.integers(-8, 8).map(lambda eighths: eighths / 8)


@settings(max_examples=60)
@given(st.data())
def test_the_search_for_helpers_is_that_of_its_authors(data) -> None:
    counts, agents, worlds = 5, 3, 2
    reward = data.draw(arrays(np.float32, worlds, elements=EIGHTHS))
    without = data.draw(arrays(np.float32, (agents, worlds), elements=EIGHTHS))
    more = data.draw(arrays(np.float32, (counts, agents, worlds), elements=EIGHTHS))
    found = jax.jit(difference_with_more)(reward, without, more)
    expected = [
        [d_plus_plus(reward[w], without[a, w], list(more[:, a, w])) for w in range(worlds)]
        for a in range(agents)
    ]
    np.testing.assert_allclose(found, expected, atol=1e-6)
    np.testing.assert_allclose(difference(jnp.asarray(reward), jnp.asarray(without)), reward - without)


@functools.cache
def episodes(credit: str, team_reward: str = "fraction"):
    """Lives episodes in many worlds; the team's reward and the credits, [steps, (agents,) worlds]."""
    env = credited(rovers(team_reward=team_reward), credit)

    @jax.jit
    def live(state, actions):
        keys = jax.random.split(jax.random.key(0), WORLDS)

        def step(state, action):
            state, step = env.step_worlds(state, action, keys)
            return state, (step.team_reward, step.local_rewards[:, -1])

        return jax.lax.scan(step, state, actions)[1]

    return live


def worlds(seed: int, credit: str = "D", team_reward: str = "fraction"):
    """The states of freshly reset worlds, and what everybody does in them."""
    key_world, key_action = jax.random.split(jax.random.key(seed))
    env = credited(rovers(team_reward=team_reward), credit)
    state, _ = jax.jit(env.reset_worlds)(jax.random.split(key_world, WORLDS))
    return state, jax.random.uniform(key_action, (STEPS, AGENTS, 2, WORLDS), minval=-1.0)


@pytest.mark.parametrize("team_reward", ["fraction", "value", "closest"])
def test_over_an_episode_it_is_what_the_team_would_miss(team_reward: str) -> None:
    state, actions = worlds(0, team_reward=team_reward)
    reward, credit = episodes("D", team_reward)(state, actions)
    fewer = rovers(AGENTS - 1, team_reward=team_reward)
    keys = jax.random.split(jax.random.key(0), WORLDS)

    @jax.jit
    def without(world, actions):
        def step(state, action):
            state, step = fewer.step_worlds(state, action, keys)
            return state, step.team_reward

        return jax.lax.scan(step, world, actions)[1].sum(0)

    assert 0 < float((reward.sum(0) > 0).mean()) < 1
    for agent in range(AGENTS):
        others = [one for one in range(AGENTS) if one != agent]
        left = dataclasses.replace(
            state.world,
            position=state.world.position[jnp.array(others)],
            heading=state.world.heading[jnp.array(others)],
        )
        expected = reward.sum(0) - without(left, actions[:, jnp.array(others)])
        np.testing.assert_allclose(credit[:, agent].sum(0), expected, atol=1e-6)
        assert 0 < float((expected > 0).mean()) < 1


def test_who_raises_its_difference_raises_the_team_s_reward() -> None:
    """Alignment: the second term does not depend on what the agent does."""
    state, actions = worlds(1)
    _, other = worlds(2)
    reward, credit = episodes("D")(state, actions)
    for agent in (0, AGENTS - 1):
        changed = actions.at[:, agent].set(other[:, agent])
        new_reward, new_credit = episodes("D")(state, changed)
        gained = new_reward.sum(0) - reward.sum(0)
        np.testing.assert_allclose(new_credit[:, agent].sum(0) - credit[:, agent].sum(0), gained, atol=1e-6)
        assert float(jnp.abs(gained).max()) > 0


def test_it_ignores_what_the_agent_cannot_influence() -> None:
    """Sensitivity: one that is far from everything has no credit, whatever the others earn."""
    state, actions = worlds(3, "D++")
    away = state.world.position.at[1].add(100.0)

    state = eqx.tree_at(lambda state: state.world.position, state, away)
    reward, credit = episodes("D++")(state, actions)
    assert float(reward.sum(0).max()) > 0
    assert not credit[:, 1].any() and credit[:, 0].any()


@pytest.mark.parametrize(
    ("near", "paid"),
    [
        # Three are needed. One alone misses two, which are shared by two helpers; of two each misses one.
        (1, [0.25, 0.0, 0.0, 0.0]),
        (2, [0.5, 0.5, 0.0, 0.0]),
        # Each of three is one that would be missed, and of four nobody is.
        (3, [0.5, 0.5, 0.5, 0.0]),
        (4, [0.0, 0.0, 0.0, 0.0]),
    ],
)
def test_helpers_pay_where_an_agent_alone_adds_nothing(near: int, paid: list[float]) -> None:
    env = rovers(spatial_coupling=3, parents={})
    places = np.full((AGENTS, 2), 50.0, np.float32)
    places[:near] = [1.0, 1.0]
    state, _ = jax.jit(env.reset)(jax.random.key(0))
    state = dataclasses.replace(
        state, position=jnp.asarray(places), poi_position=jnp.array([[1.0, 1.0], [-60.0, 0.0]])
    )
    still = jnp.zeros((AGENTS, 2)).at[:, 1].set(-1.0)
    for credit, expected in (("D++", paid), ("D", [0.5 * (near == 3) * (one < 3) for one in range(AGENTS)])):
        world = Credited(env, credit)
        begun = dataclasses.replace(
            jax.jit(world.reset)(jax.random.key(0))[0], world=state, others=world._teams.begin(state)
        )
        _, step = jax.jit(world.step)(begun, still, jax.random.key(1))
        np.testing.assert_allclose(step.local_rewards[:, -1], expected, atol=1e-6)
        np.testing.assert_allclose(step.team_reward, 0.5 * (near >= 3))


def test_one_alone_is_credited_with_everything() -> None:
    env = rovers(1, spatial_coupling=1)
    for credit in ("D", "D++"):
        world = Credited(env, credit)
        assert world.skills == (*env.skills, credit)
        many, _ = jax.jit(world.reset_worlds)(jax.random.split(jax.random.key(4), WORLDS))
        step = jax.jit(world.step_worlds)
        paid = 0.0
        for _ in range(6):
            action = jax.random.uniform(jax.random.key(5), (1, 2, WORLDS), minval=-1.0)
            many, said = step(many, action, jax.random.split(jax.random.key(6), WORLDS))
            np.testing.assert_array_equal(said.local_rewards[0, -1], said.team_reward)
            paid += float(said.team_reward.sum())
        assert paid > 0


def test_rovers_that_differ_are_credited_too() -> None:
    env = credited(sc.make("rover-t2-crew", episode_length=STEPS), "D")
    assert env.types == () and env.skills[-1] == "D"
    state, _ = jax.jit(env.reset)(jax.random.key(0))
    _, step = jax.jit(env.step)(state, jnp.zeros((env.n_agents, env.action_size)), jax.random.key(1))
    assert step.local_rewards.shape == (env.n_agents, len(env.skills))


class Wheels(sc.Environment):
    """One step: the team is paid the sum of what its agents do, each its own way; no other knows."""

    n_agents, observation_size, action_size, episode_length = 5, 1, 1, 1
    skills = ()
    ways = np.array([1.0, -1.0, 1.0, 1.0, -1.0], np.float32)

    def reset(self, key):
        return {"time": jnp.zeros((), jnp.int32)}, jnp.ones((5, 1))

    def step(self, state, action, key):
        after, reward = self.counterfactual_step(state, state, action, key, jnp.ones(5, jnp.int32))
        end = jnp.ones((), bool)
        return after, sc.TimeStep(jnp.ones((5, 1)), jnp.zeros((5, 0)), reward, end, ~end)

    def counterfactual(self, state):
        return state

    def counterfactual_step(self, state, other, action, key, copies):
        paid = (self.ways * action[:, 0] * copies.astype(jnp.float32)).sum()
        return {"time": other["time"] + 1}, paid


RATES = {"actor_learning_rate": 0.02, "critic_learning_rate": 0.02}


@functools.cache
def learned(reward: str) -> np.ndarray:
    """How far each agent's action goes its way after three generations."""
    td3 = sc.IndependentTD3(
        Wheels(),
        reward=reward,
        episodes=128,
        updates=40,
        exploration_noise=0.6,
        learner=sc.TD3Config(batch_size=32, **RATES, network=sc.NetworkConfig(hidden=(4,))),
    )

    @jax.jit
    def does(key):
        team = td3.team(jax.lax.scan(lambda state, _: td3.step(state), td3.init(key), length=3)[0])
        return team.act(jnp.ones((5, 1)), team.initial_memory(), jax.random.key(1))[0]

    action = does(jax.random.key(0))
    return np.asarray(action)[:, 0] * Wheels.ways


@pytest.mark.parametrize("credit", ["D", "D++"])
def test_learners_are_paid_by_it(credit: str) -> None:
    assert (learned(credit) > 0.5).all(), (learned(credit), learned("team"))


@pytest.mark.parametrize("credit", ["D", "D++"])
def test_coevolution_breeds_each_agent_s_individuals_for_it(credit: str) -> None:
    """Whoever goes its way farthest is the best of its subpopulation, whoever it was teamed up with."""
    plain = sc.EvolutionConfig(elites=1, lineage_prior=0.0, champion_prior=0.0)
    ccea = sc.CCEA(Wheels(), reward=credit, population=12, episodes=1, evolution=plain)
    begun = jax.jit(ccea.init)(jax.random.key(3))
    after, _ = jax.jit(ccea.step)(begun)
    teams = ccea._search._evolver.genomes(begun.search)

    def goes(genome):
        team = ccea._make_team(ccea._search._codec.decode(genome))
        return team.act(jnp.ones((5, 1)), team.initial_memory(), jax.random.key(1))[0][:, 0] * Wheels.ways

    own = jax.jit(jax.vmap(goes))(teams)
    best = jax.vmap(lambda team, agent: teams.reshape(12, 5, -1)[team, agent])(own.argmax(0), jnp.arange(5))
    np.testing.assert_array_equal(ccea._search._evolver.champion(after.search), best.reshape(-1))


def test_who_cannot_be_credited_is_refused_by_name() -> None:
    for fields, said in (
        ({"reward": "E"}, "unknown reward 'E'; valid, nearest first: .*D"),
        ({"reward": "D", "evolver": "genetic"}, "evolver = genetic breeds whole teams; set evolver to coev"),
        (
            {"reward": "D", "race": sc.RaceConfig(finalists=3)},
            "race.finalists = 3: .*set race.finalists to 0",
        ),
    ):
        with pytest.raises(UserError, match=said):
            sc.CCEA(rovers(), **fields)


def test_without_counterfactuals_it_is_refused_by_name() -> None:
    class Silent(sc.Environment):
        n_agents, observation_size, action_size, episode_length, skills = 2, 1, 1, 3, ()
        reset = step = lambda self, *_: None

    with pytest.raises(UserError, match=r"reward = D\+\+ needs counterfactual.*silent does not offer"):
        sc.IndependentTD3(Silent(), reward="D++")
    for algorithm in (sc.ERL, sc.MERL, sc.CERL):
        with pytest.raises(UserError, match=r"reward = D: .*td3, ddpg, dqn, .* coma and liir learn"):
            algorithm(rovers(), reward="D")
    with pytest.raises(UserError, match=r"unknown reward 'E'.* D, D\+\+, go_to_poi_A"):
        sc.IndependentTD3(rovers(), reward="E")
