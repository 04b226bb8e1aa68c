"""Teams that draw what they do, and choices that are kept."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from skillcrew.policies.actor import Actor
from skillcrew.policies.holding import decided, hold
from skillcrew.policies.memory import PolicyConfig
from skillcrew.policies.network import NetworkConfig
from skillcrew.policies.orthogonal import RECTIFIED
from skillcrew.policies.stochastic import LAST_GAIN, Options, StochasticPolicy, StochasticTeam

AGENTS, OBSERVATION, ACTION, SKILLS = 3, 5, 2, 4
OBSERVED = jax.random.normal(jax.random.key(9), (AGENTS, OBSERVATION))


def team(options: Options, hold: int = 1, floor: float = 0.0, greedy: bool = False, memory: int = 0):
    config = PolicyConfig(hidden=(8,), memory=memory, input_scaling="none")
    network = NetworkConfig(hidden=(8,), input_scaling="none")
    policies = jax.jit(jax.vmap(lambda key: StochasticPolicy.create(key, OBSERVATION, options, config)))(
        jax.random.split(jax.random.key(0), AGENTS)
    )
    skills = jax.jit(jax.vmap(lambda key: Actor.create(key, OBSERVATION, ACTION, network)))(
        jax.random.split(jax.random.key(1), SKILLS)
    )
    chosen = None if options.continuous or options.size != SKILLS else skills
    return StochasticTeam(policies, chosen, jnp.asarray(floor), options, AGENTS, hold, greedy)


def lived(acting: StochasticTeam, steps: int) -> np.ndarray:
    """Each agent's choices."""

    def one_step(memory, key):
        _, memory, choice = eqx.filter_jit(acting.act)(OBSERVED, memory, key)
        return memory, choice

    keys = jax.random.split(jax.random.key(2), steps)
    return np.asarray(jax.lax.scan(one_step, acting.initial_memory(), keys)[1])


def test_policies_begin_nearly_even_and_orthogonal() -> None:
    policies = team(Options(SKILLS)).policies
    first, last = (np.asarray(weights[0]) for weights in policies.network.network.weights)
    np.testing.assert_allclose(first @ first.T, RECTIFIED**2 * np.eye(OBSERVATION), atol=1e-5)
    np.testing.assert_allclose(last.T @ last, LAST_GAIN**2 * np.eye(SKILLS), atol=1e-5)
    frequency = np.bincount(lived(team(Options(SKILLS)), 1500).ravel(), minlength=SKILLS) / (1500 * AGENTS)
    np.testing.assert_allclose(frequency, 1 / SKILLS, atol=0.03)


def test_agents_act_by_the_skill_that_they_drew() -> None:
    acting = team(Options(SKILLS), memory=3)
    action, _, choice = eqx.filter_jit(acting.act)(OBSERVED, acting.initial_memory(), jax.random.key(5))
    choice, skills, observed = jax.device_get((choice, acting.skills, OBSERVED))
    say = jax.jit(lambda skill, seen: skill(seen))
    for agent in range(AGENTS):
        skill = jax.tree.map(lambda leaf, own=int(choice[agent]): leaf[own], skills)
        np.testing.assert_allclose(np.asarray(action)[agent], say(skill, observed[agent]), rtol=1e-5)


def test_a_greedy_team_draws_nothing() -> None:
    choices = lived(team(Options(SKILLS), greedy=True), 30)
    assert (choices == choices[0]).all()
    assert not (lived(team(Options(SKILLS)), 30) == choices[0]).all()


def test_what_an_agent_does_not_have_it_never_chooses_not_even_to_explore() -> None:
    available = ((True, False, True, False), (False, True, True, True), (False, False, False, True))
    choices = lived(team(Options(SKILLS, available=available), floor=0.5), 200)
    for agent in range(AGENTS):
        assert set(choices[:, agent]) == {skill for skill in range(SKILLS) if available[agent][skill]}


def test_primitive_actions_are_drawn_too() -> None:
    moving = team(Options(ACTION, continuous=True))
    action, _, choice = eqx.filter_jit(moving.act)(OBSERVED, moving.initial_memory(), jax.random.key(5))
    assert action.shape == (AGENTS, ACTION)
    assert (jnp.abs(action) < 1).all()
    assert choice.tolist() == [0] * AGENTS
    picking = team(Options(7))
    action, _, choice = eqx.filter_jit(picking.act)(OBSERVED, picking.initial_memory(), jax.random.key(5))
    assert action.dtype == jnp.int32
    assert choice.tolist() == [0] * AGENTS


@pytest.mark.parametrize("log_deviation", [-9.0, -2.0, 0.0])
@pytest.mark.parametrize("wanted", [0.5, 9.0, -1e4])
def test_actions_at_the_border_are_about_as_probable_after_a_small_step(
    wanted: float, log_deviation: float
) -> None:
    """However far beyond the border a policy aims; ratios of probabilities say nothing else."""
    options = Options(1, continuous=True)
    before = options.distribution(jnp.array([[wanted, log_deviation]]))
    after = options.distribution(jnp.array([[1.001 * wanted, log_deviation]]))
    taken = jax.vmap(before.sample)(jax.random.split(jax.random.key(3), 200))
    ratio = jnp.exp(jax.vmap(after.log_probability)(taken) - jax.vmap(before.log_probability)(taken))
    np.testing.assert_allclose(ratio, 1.0, atol=0.3)


@pytest.mark.parametrize("steps", [2, 5])
def test_a_new_choice_is_kept_so_long(steps: int) -> None:
    choices = lived(team(Options(SKILLS), hold=steps), 60)
    for agent in range(AGENTS):
        changes = np.flatnonzero(np.diff(choices[:, agent])) + 1
        assert (np.diff(np.concatenate([[0], changes])) >= steps).all()
        assert len(changes) > 5


def test_when_there_was_a_choice_is_told_by_the_choices_alone() -> None:
    acting = team(Options(SKILLS), hold=3)
    free, choices = [], []
    memory = acting.initial_memory()
    for key in jax.random.split(jax.random.key(2), 40):
        free.append(np.asarray(memory[1] <= 0))
        _, memory, choice = eqx.filter_jit(acting.act)(OBSERVED, memory, key)
        choices.append(choice)
    np.testing.assert_array_equal(decided(jnp.stack(choices), 3), np.stack(free))
    assert decided(jnp.stack(choices), 1).all()
    assert not np.stack(free).all()


def test_the_same_choice_again_may_be_left_at_once() -> None:
    left, kept = jnp.array(0), jnp.array(2)
    choice, left = hold(left, kept, jnp.array(2), 4)
    assert (int(choice), int(left)) == (2, -1)
    choice, left = hold(left, choice, jnp.array(1), 4)
    assert (int(choice), int(left)) == (1, 3)
