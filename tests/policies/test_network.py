"""Feed-forward networks and what is built of them, against NumPy."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from oracles.refusals import refusal, unhooked
from oracles.td3 import Net
from skillcrew.policies import network
from skillcrew.policies.actor import Actor
from skillcrew.policies.critic import Critic
from skillcrew.policies.memory import MemoryNetwork, PolicyConfig
from skillcrew.policies.network import MLP, NetworkConfig, scale_input
from skillcrew.policies.selector import Selector

OBSERVATION = np.array([0.25, -4.0, 0.0, 1.0, 9.0], np.float32)
SCALED = np.array([1.0, -4.0, 0.0, 2.0, 6.0])
SYMLOG = np.sign(OBSERVATION) * np.log1p(np.abs(OBSERVATION))
ACTION = np.array([0.5, -0.25], np.float32)


def forward(mlp: MLP, x: np.ndarray) -> np.ndarray:
    # Biases start at 0, which would hide that they are used.
    return Net([np.asarray(w) for w in mlp.weights], [np.asarray(b) for b in mlp.biases]).forward(x[None])[0][
        0
    ]


def with_biases(policy):
    biases = tuple(0.1 + jnp.arange(bias.size, dtype=jnp.float32) for bias in policy.network.biases)
    network = MLP(policy.network.weights, biases)
    if isinstance(policy, MemoryNetwork):
        return MemoryNetwork(network, None, policy.input_scaling)
    return type(policy)(network, policy.input_scaling)


def test_symlog_is_linear_near_zero_and_logarithmic_far_from_it_as_is_what_nobody_scales() -> None:
    seen = jnp.array([-1e6, -3.0, -1e-4, 0.0, 1e-4, 3.0, 1e6])
    expected = [-np.log1p(1e6), -np.log(4), -1e-4, 0.0, 1e-4, np.log(4), np.log1p(1e6)]
    assert NetworkConfig().scaling == "symlog"
    np.testing.assert_allclose(scale_input(seen, "symlog"), expected, rtol=1e-3)


def test_sqrt_scaling_is_twice_the_signed_root() -> None:
    np.testing.assert_allclose(scale_input(jnp.asarray(OBSERVATION), "sqrt"), SCALED)
    np.testing.assert_array_equal(scale_input(jnp.asarray(OBSERVATION), "none"), OBSERVATION)


@pytest.mark.parametrize(("scaling", "seen"), [("sqrt", SCALED), ("none", OBSERVATION), ("symlog", SYMLOG)])
def test_policies_and_critics_equal_numpy(scaling, seen) -> None:
    config = NetworkConfig(hidden=(7, 4), input_scaling=scaling)
    actor = with_biases(Actor.create(jax.random.key(0), 5, 2, config))
    unbounded = forward(actor.network, seen)
    np.testing.assert_allclose(actor.before_squashing(jnp.asarray(OBSERVATION)), unbounded, rtol=1e-4)
    np.testing.assert_allclose(actor(jnp.asarray(OBSERVATION)), np.tanh(unbounded), rtol=1e-4)
    critic = with_biases(Critic.create(jax.random.key(1), 5, 2, config))
    # The action is no sensor reading and comes as it is.
    expected = forward(critic.network, np.concatenate([seen, ACTION]))[0]
    np.testing.assert_allclose(critic(jnp.asarray(OBSERVATION), jnp.asarray(ACTION)), expected, rtol=1e-4)
    selector = Selector.create(jax.random.key(2), 5, 3, PolicyConfig(hidden=(7, 4), input_scaling=scaling))
    network = with_biases(selector.network)
    choice, memory = Selector(network)(jnp.asarray(OBSERVATION), jnp.zeros(0))
    assert int(choice) == forward(network.network, seen).argmax()
    assert memory.shape == (0,)


def test_layers_have_their_sizes_and_weights_their_deviations() -> None:
    mlp = MLP.create(jax.random.key(3), (50, 200, 100, 40))
    assert [weight.shape for weight in mlp.weights] == [(50, 200), (200, 100), (100, 40)]
    deviations = [float(weight.std()) for weight in mlp.weights]
    assert deviations == pytest.approx([(2 / 50) ** 0.5, (2 / 200) ** 0.5, (1 / 100) ** 0.5], rel=0.05)
    assert all(not bias.any() for bias in mlp.biases)
    # All of one draw, none of it used twice.
    drawn = np.concatenate(
        [np.asarray(weight).ravel() / d for weight, d in zip(mlp.weights, deviations, strict=True)]
    )
    assert len(np.unique(drawn.round(6))) > 0.9 * drawn.size


@pytest.mark.parametrize("hidden", [(8, 0), (-3,), (2.5,)])
def test_impossible_layers_are_refused(hidden) -> None:
    assert f"hidden = {hidden}" in refusal(unhooked(network).NetworkConfig, hidden=hidden)


def test_unknown_scaling_is_refused_with_the_valid_ones() -> None:
    message = refusal(unhooked(network).NetworkConfig, input_scaling="sqr")
    assert "input_scaling 'sqr'" in message
    assert all(name in message for name in ("environment", "symlog", "sqrt", "none"))
