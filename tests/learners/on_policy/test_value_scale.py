"""Critics learn numbers of about 1, whatever returns are."""

import jax.numpy as jnp
import numpy as np

from oracles import on_policy as oracle
from skillcrew.learners.on_policy.value_scale import LEAST_VARIANCE, ValueScale

MASK = oracle.lived(0).mask
COUNTS = jnp.broadcast_to(MASK[..., None], (oracle.TIME, oracle.WORLDS, oracle.AGENTS))


def test_the_first_returns_already_set_the_scale() -> None:
    returns = jnp.asarray(oracle.values(0)[:-1]) * 40 - 300
    scale = ValueScale.create().observe(jnp.where(COUNTS, returns, jnp.nan), MASK)
    counted = np.asarray(returns)[np.asarray(COUNTS)]
    normalised = np.asarray(scale.normalised(returns))[np.asarray(COUNTS)]
    np.testing.assert_allclose([normalised.mean(), normalised.std()], [0, 1], atol=1e-2)
    np.testing.assert_allclose(scale.returns(jnp.asarray(normalised)), counted, rtol=1e-4)


def test_it_follows_what_returns_become() -> None:
    scale = ValueScale.create()
    for height in [0.0] * 300 + [10.0] * 300:
        scale = scale.observe(jnp.full(COUNTS.shape, height), MASK)
    # 0.99 to the 300th of what was known is left.
    assert scale.returns(jnp.zeros(())) > 9.0


def test_nothing_changes_before_anything_is_known_and_equal_returns_are_not_blown_up() -> None:
    assert ValueScale.create().normalised(jnp.array([3.0])) == 3
    scale = ValueScale.create().observe(jnp.full(COUNTS.shape, 2.0), MASK)
    assert abs(scale.normalised(jnp.array(2.1)) - 0.1 / LEAST_VARIANCE**0.5) < 1e-3
