"""What policies draw from, against closed forms and frequencies."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import integrate

from skillcrew.policies.distributions import Categorical, SquashedNormal, with_floor

LOGITS = jnp.array([[0.3, -1.0, 2.0], [0.0, 0.0, -1e9]])


def test_choices_are_drawn_as_often_as_is_said() -> None:
    said = Categorical(LOGITS)
    drawn = jax.vmap(said.sample)(jax.random.split(jax.random.key(0), 4000))
    frequency = np.stack([np.bincount(np.asarray(row), minlength=3) for row in drawn.T]) / 4000
    np.testing.assert_allclose(frequency, said.probabilities(), atol=0.03)
    assert said.mode().tolist() == [2, 0]


def test_of_choices() -> None:
    said = Categorical(LOGITS)
    expected = np.exp([0.3, -1.0, 2.0]) / np.exp([0.3, -1.0, 2.0]).sum()
    np.testing.assert_allclose(said.log_probability(jnp.array([1, 0])), np.log([expected[1], 0.5]), rtol=1e-5)
    entropy = -(expected * np.log(expected)).sum()
    # A choice that is not there adds nothing, and nothing infinite.
    np.testing.assert_allclose(said.entropy(), [entropy, np.log(2)], rtol=1e-5)
    gradient = jax.grad(lambda logits: Categorical(logits).entropy().sum())(LOGITS)
    assert jnp.isfinite(gradient).all()


@pytest.mark.parametrize(("mean", "deviation"), [(0.3, 0.5), (-1.2, 1.5)])
def test_the_density_of_actions_is_one(mean: float, deviation: float) -> None:
    said = SquashedNormal(jnp.array([mean]), jnp.log(jnp.array([deviation])))

    def density(action: float) -> float:
        return float(jnp.exp(said.log_probability(jnp.array([action]))))

    whole, _ = integrate.quad(density, -1, 1, limit=60, epsabs=1e-3)
    assert whole == pytest.approx(1, abs=5e-3)
    drawn = jax.vmap(said.sample)(jax.random.split(jax.random.key(1), 4000))
    below, _ = integrate.quad(density, -1, 0.2, limit=60, epsabs=1e-3)
    assert (drawn < 0.2).mean() == pytest.approx(below, abs=0.03)
    assert said.mode() == pytest.approx(np.tanh(mean))


def test_actions_at_the_border_have_a_finite_density() -> None:
    said = SquashedNormal(jnp.array([2.0, -1.0]), jnp.zeros(2))
    value, gradient = jax.value_and_grad(
        lambda mean: SquashedNormal(mean, jnp.zeros(2)).log_probability(jnp.array([1.0, -1.0]))
    )(said.mean)
    assert jnp.isfinite(value)
    assert jnp.isfinite(gradient).all()


def test_a_share_is_drawn_evenly_among_what_there_is() -> None:
    available = jnp.array([[True, True, True], [True, True, False]])
    mixed = with_floor(Categorical(LOGITS), jnp.array(0.3), available)
    own = np.asarray(Categorical(LOGITS).probabilities())
    np.testing.assert_allclose(mixed.probabilities()[0], 0.7 * own[0] + 0.1, rtol=1e-5)
    np.testing.assert_allclose(mixed.probabilities()[1], [0.5, 0.5, 0.0], atol=1e-6)
    np.testing.assert_allclose(with_floor(Categorical(LOGITS), jnp.zeros(())).probabilities(), own, atol=1e-6)
