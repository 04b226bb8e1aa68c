"""Agents that differ: skills within a type, a selector for each agent or type."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import skillcrew as sc
from oracles.mixed import LENGTH, SKILLS, Mixed, MixedDiscrete
from skillcrew.algorithms.registry import ALGORITHMS
from skillcrew.algorithms.repertoire import Repertoire
from skillcrew.experiment.export.structure import taken_apart
from skillcrew.learners.dqn import DQNConfig
from skillcrew.learners.td3 import TD3Config
from skillcrew.replay import ReplayBuffer, Transitions
from skillcrew.rollout import Lineup, Start, rollout

DISCRETE_ONLY, CONTINUOUS_ONLY = {"dqn"}, {"td3", "ddpg"}


@pytest.mark.parametrize("name", sorted(ALGORITHMS))
def test_everybody_steps(name):
    for kind, without in ((Mixed, DISCRETE_ONLY), (MixedDiscrete, CONTINUOUS_ONLY)):
        if name in without:
            continue
        algorithm = sc.make_algorithm(name, kind())
        before = jax.eval_shape(algorithm.init, jax.random.key(0))
        after, metrics = jax.eval_shape(algorithm.step, before)
        assert "fitness_best" in metrics
        # A first state of other types, weak ones included, would have a step compiled twice.
        assert jax.tree.map(signature, after) == jax.tree.map(signature, before)
        # A team of another make could not be exported.
        team = jax.eval_shape(algorithm.team, after)
        assert taken_apart(jax.tree.map(lambda leaf: np.zeros(leaf.shape, leaf.dtype), team))


def signature(leaf):
    return leaf.shape, leaf.dtype, leaf.weak_type


def test_a_repertoire_knows_whose_skills_are_whose():
    # The hauler's "wait" is left out.
    names = tuple(name for name in SKILLS if name != "hauler/wait")
    repertoire = Repertoire.of(Mixed(), names)
    assert repertoire.skills == ((0, 1), (2, 3))
    every = Repertoire.of(Mixed(), SKILLS)
    assert every.choices == 3
    # A scout's third choice is its first skill again.
    assert every.of_agents == ((0, 1, 0), (0, 1, 0), (2, 3, 4))
    assert every.members.of_skills == ((0, 2), (0, 2), (2, 1), (2, 1), (2, 1))
    for skill, agents in enumerate(every.partners):
        own = [agent for agent, used in enumerate(agents) if used == skill]
        assert own == ([0, 1] if skill < 2 else [2])
        assert all(used in choices for used, choices in zip(agents, every.of_agents, strict=True))
    assert every.users[1] == (True, True, False)


def test_a_type_without_a_skill_to_choose_is_named():
    with pytest.raises(sc.UserError, match=r"type hauler have none of them .*hauler/drop, hauler/lift"):
        sc.MADyS(Mixed(), skills=("scout/left", "scout/right"))


def test_skills_learn_from_agents_of_their_own_type():
    agents, capacity = 3, 12
    buffer = ReplayBuffer(capacity, 1, 1, 1)
    state = buffer.init()
    for step in range(3):
        who = jnp.tile(jnp.arange(agents, dtype=jnp.float32), 2)[:, None]
        rows = Transitions(who, who, who, who, jnp.full(6, step * 1.0), jnp.zeros(6))
        state = buffer.add(state, rows, jnp.ones(6, bool))
    drawn = buffer.sample_of(state, jax.random.key(0), 400, jnp.array([1, 2]), agents)
    seen, counts = np.unique(np.asarray(drawn.observation), return_counts=True)
    np.testing.assert_array_equal(seen, [1, 2])
    assert counts.min() > 150
    # The first rows were overwritten, all others are drawn.
    np.testing.assert_array_equal(np.unique(np.asarray(drawn.team_reward)), [1, 2])


def make(kind, **fields):
    network = sc.NetworkConfig(hidden=(16,), input_scaling="none")
    rates = {"actor_learning_rate": 1e-2, "critic_learning_rate": 1e-2}
    learner = TD3Config(discount=0.0, batch_size=32, network=network, **rates)
    dqn = DQNConfig(discount=0.0, learning_rate=1e-2, soft_update=0.1, batch_size=32, network=network)
    return sc.MADySPlus(
        kind(),
        episodes=1,
        probe_episodes=1,
        updates=60,
        exploration_noise=0.1,
        selector=sc.SelectorConfig(phases=2, alike=0.5, **fields),
        learner=learner,
        dqn=dqn,
    )


@pytest.mark.parametrize(("kind", "sharing"), [(Mixed, "team"), (MixedDiscrete, "agent")])
def test_they_learn_together(kind, sharing):
    algorithm = make(kind, sharing=sharing)

    @jax.jit
    def train_and_play():
        state = algorithm.init(jax.random.key(0))
        state, _ = jax.lax.scan(lambda state, _: algorithm.step(state), state, length=45)
        start = Start.draw(algorithm.env, jax.random.key(1), 2)
        lineup = Lineup.of_team(algorithm.team(state), start)
        played = rollout(algorithm.env, lineup, jax.random.key(2))[1]
        return played.team_return(), played.choice

    returns, chosen = jax.device_get(train_and_play())
    np.testing.assert_array_less(0.95, returns)
    choices = [[SKILLS[skill] for skill in chosen[time, 0]] for time in (0, LENGTH - 1)]
    assert choices[0] == ["scout/left", "scout/left", "hauler/lift"]
    assert choices[-1] == ["scout/right", "scout/right", "hauler/drop"]


@pytest.mark.parametrize("name", ["td3", "merl"])
def test_one_actor_cannot_be_all_of_them(name):
    kind = {"td3": sc.IndependentTD3, "merl": sc.MERL}[name]
    with pytest.raises(sc.UserError, match=r"sharing = team: agents of mixed differ \(scout, hauler\)"):
        kind(Mixed(), sharing="team")
