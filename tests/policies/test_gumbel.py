"""The straight-through Gumbel-softmax: what goes forward, and what comes back."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from skillcrew.policies.gumbel import straight_through

LOGITS = jnp.array([0.3, -1.2, 1.1, 0.4])


def test_forward_is_one_action_drawn_by_its_chance() -> None:
    keys = jax.random.split(jax.random.key(0), 4000)
    drawn = np.asarray(jax.jit(jax.vmap(lambda key: straight_through(key, LOGITS, 0.3)))(keys))
    assert set(np.unique(drawn)) == {0.0, 1.0}
    np.testing.assert_array_equal(drawn.sum(1), 1.0)
    np.testing.assert_allclose(drawn.mean(0), jax.nn.softmax(LOGITS), atol=0.03)


@pytest.mark.parametrize("temperature", [0.4, 1.0, 3.0])
def test_backward_is_the_soft_sample_s(temperature: float) -> None:
    key, weight = jax.random.key(7), jnp.array([2.0, -1.0, 0.5, 3.0])

    def soft(logits):
        disturbed = logits + jax.random.gumbel(key, logits.shape)
        return (weight * jax.nn.softmax(disturbed / temperature)).sum()

    def passed(logits):
        return (weight * straight_through(key, logits, temperature)).sum()

    expected = jax.grad(soft)(LOGITS)
    np.testing.assert_allclose(jax.grad(passed)(LOGITS), expected, rtol=1e-6)
    assert float(jnp.abs(expected).min()) > 1e-4
