"""Networks that remember, against NumPy, and what it means that agents share one."""

import functools
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.flatten_util import ravel_pytree

from oracles.recurrent import remember
from oracles.refusals import refusal, unhooked
from oracles.toy import Toy
from skillcrew.policies import memory as module
from skillcrew.policies.actor import Actor
from skillcrew.policies.memory import MemoryNetwork, PolicyConfig, collected, dealt_out, for_each_agent
from skillcrew.policies.network import MLP, NetworkConfig
from skillcrew.policies.selector import Selector
from skillcrew.policies.team import ActorTeam, SkillTeam

AGENTS, OBSERVATION, OUTPUTS, UNITS, STEPS, SKILLS = 5, 4, 2, 3, 6, 7


def drawn(create: Callable[[Any], Any], count: int, seed: int) -> Any:
    """So many networks, stacked, of which every number is drawn: what starts at 0 would hide its use."""
    rng = np.random.default_rng(seed)
    shapes = jax.eval_shape(create, jax.random.key(0))
    return jax.tree.map(
        lambda leaf: jnp.asarray(rng.normal(0, 0.7, (count, *leaf.shape)), jnp.float32), shapes
    )


def networks_of(count: int, outputs: int, seed: int = 0, **fields: Any) -> MemoryNetwork:
    config = PolicyConfig(**{"hidden": (6,), "memory": UNITS, "input_scaling": "sqrt", **fields})
    return drawn(lambda key: MemoryNetwork.create(key, OBSERVATION, outputs, config), count, seed)


def at(tree: Any, index: int) -> Any:
    return jax.tree.map(lambda leaf: leaf[index], tree)


def observations(seed: int = 1, steps: int = STEPS) -> np.ndarray:
    return np.random.default_rng(seed).normal(0, 2, (steps, AGENTS, OBSERVATION)).astype(np.float32)


@pytest.mark.parametrize("scaling", ["symlog", "sqrt", "none"])
def test_a_recurrent_network_equals_the_equations_step_by_step(scaling: str) -> None:
    network = at(networks_of(1, OUTPUTS, input_scaling=scaling), 0)
    call = jax.jit(MemoryNetwork.__call__)
    memory, expected_memory = network.initial_memory(), np.zeros(UNITS)
    assert memory.tolist() == [0.0] * UNITS
    for observation in observations()[:, 0]:
        outputs, memory = call(network, jnp.asarray(observation), memory)
        expected, expected_memory = remember(network, observation, expected_memory)
        np.testing.assert_allclose(outputs, expected, rtol=1e-4, atol=1e-5)
        np.testing.assert_allclose(memory, expected_memory, rtol=1e-4, atol=1e-5)


def test_without_memory_it_is_the_plain_network_and_remembers_nothing() -> None:
    key, config = jax.random.key(3), PolicyConfig(hidden=(6, 5), input_scaling="none")
    network = MemoryNetwork.create(key, OBSERVATION, OUTPUTS, config)
    plain = MLP.create(key, (OBSERVATION, 6, 5, OUTPUTS))
    assert network.unit is None
    assert network.initial_memory().shape == (0,)
    observation = jnp.asarray(observations()[0, 0])
    outputs, memory = network(observation, network.initial_memory())
    np.testing.assert_array_equal(outputs, plain(observation))
    assert memory.shape == (0,)


def test_a_drawn_recurrent_network_has_no_part_of_another() -> None:
    config = PolicyConfig(hidden=(6,), memory=UNITS)
    one, other = (MemoryNetwork.create(jax.random.key(seed), OBSERVATION, OUTPUTS, config) for seed in (1, 2))
    assert one.network.weights[0].shape == (OBSERVATION + UNITS, 6)
    values = ravel_pytree((one.network.weights, one.unit, other.network.weights, other.unit))[0]
    assert len(np.unique(values)) == values.size


@pytest.mark.parametrize("count", [AGENTS, 1])
def test_each_agent_gets_what_its_own_network_gives(count: int) -> None:
    networks = networks_of(count, OUTPUTS)
    memories = np.random.default_rng(2).uniform(-1, 1, (AGENTS, UNITS))
    seen = observations()[0]
    call = jax.jit(functools.partial(for_each_agent, MemoryNetwork.__call__))
    outputs, after = call(networks, jnp.asarray(seen), jnp.asarray(memories, jnp.float32))
    for agent in range(AGENTS):
        own = at(networks, agent if count > 1 else 0)
        expected, expected_memory = remember(own, seen[agent], memories[agent])
        np.testing.assert_allclose(outputs[agent], expected, rtol=1e-4, atol=1e-5)
        np.testing.assert_allclose(after[agent], expected_memory, rtol=1e-4, atol=1e-5)


def skill_team(count: int, memory: int = UNITS) -> SkillTeam:
    config = NetworkConfig(hidden=(4,))
    skills = drawn(lambda key: Actor.create(key, OBSERVATION, OUTPUTS, config), SKILLS, 9)
    return SkillTeam(Selector(networks_of(count, SKILLS, 4, memory=memory)), skills, AGENTS)


act = jax.jit(lambda team, seen, memory: team.act(seen, memory, jax.random.key(0)))


@pytest.mark.parametrize("memory_units", [UNITS, 0])
@pytest.mark.parametrize("count", [AGENTS, 1])
def test_a_team_of_selectors_acts_as_its_agents_would_alone(count: int, memory_units: int) -> None:
    team = skill_team(count, memory_units)
    memory = team.initial_memory()
    assert memory.shape == (AGENTS, memory_units)
    own_memories = [np.zeros(memory_units)] * AGENTS
    chosen = set()
    for seen in observations():
        action, memory, choice = act(team, jnp.asarray(seen), memory)
        for agent in range(AGENTS):
            own = at(team.selectors, agent if count > 1 else 0).network
            scores, own_memories[agent] = remember(own, seen[agent], own_memories[agent])
            assert int(choice[agent]) == scores.argmax()
            skill = at(team.skills, int(choice[agent]))
            expected = np.tanh(
                remember(MemoryNetwork(skill.network, None, skill.input_scaling), seen[agent], np.zeros(0))[0]
            )
            np.testing.assert_allclose(action[agent], expected, rtol=1e-4, atol=1e-5)
            chosen.add(int(choice[agent]))
    assert len(chosen) > 1


@pytest.mark.parametrize("count", [AGENTS, 1])
def test_a_team_of_actors_acts_as_its_agents_would_alone(count: int) -> None:
    team = ActorTeam(networks_of(count, OUTPUTS), AGENTS)
    memory = team.initial_memory()
    own_memories = [np.zeros(UNITS)] * AGENTS
    for seen in observations():
        action, memory, choice = act(team, jnp.asarray(seen), memory)
        assert choice.tolist() == [0] * AGENTS
        for agent in range(AGENTS):
            own = at(team.actors, agent if count > 1 else 0)
            outputs, own_memories[agent] = remember(own, seen[agent], own_memories[agent])
            np.testing.assert_allclose(action[agent], np.tanh(outputs), rtol=1e-4, atol=1e-5)


def present_choices(team: SkillTeam, pasts: np.ndarray) -> list[int]:
    """What agents choose who have seen these pasts, and all see the same now."""
    memory = team.initial_memory()
    for seen in pasts:
        _, memory, _ = act(team, jnp.asarray(seen), memory)
    now = np.tile(observations(8)[0, :1], (AGENTS, 1))
    return act(team, jnp.asarray(now), memory)[2].tolist()


def test_agents_who_share_a_network_remember_their_own_past() -> None:
    team = skill_team(1)
    alike = np.tile(observations()[:, :1], (1, AGENTS, 1))
    assert len(set(present_choices(team, alike))) == 1
    assert len(set(present_choices(team, observations()))) > 1
    # Without memory the past makes no difference.
    assert len(set(present_choices(skill_team(1, 0), observations()))) == 1


def test_a_team_has_a_network_for_each_agent_or_one() -> None:
    env = Toy()
    assert PolicyConfig().networks(env) == env.n_agents
    assert PolicyConfig(sharing="team").networks(env) == 1


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        ({"memory": -1}, ["memory = -1", "give a number of units up to 8192, or 0 for no memory"]),
        ({"sharing": "teem"}, ["sharing 'teem'", "nearest first: team, agent"]),
        ({"hidden": (0,)}, ["hidden = (0,)", "at least 1 unit"]),
        ({"input_scaling": "root"}, ["input_scaling 'root'", "sqrt", "none"]),
    ],
)
def test_what_cannot_be_meant_is_refused(fields: dict[str, Any], expected: list[str]) -> None:
    message = refusal(unhooked(module).PolicyConfig, **fields)
    for part in expected:
        assert part in message


@pytest.mark.parametrize("types", [(), (0, 0, 1, 2, 2)])
def test_what_is_dealt_out_is_collected_again(types):
    networks, config = jnp.arange(3.0), PolicyConfig(sharing="team")
    np.testing.assert_array_equal(collected(dealt_out(networks, types, config), types, config), networks)
