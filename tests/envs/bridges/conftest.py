"""JaxMARL relies on JAX's usual promotion, from which our own tests are kept."""

import jax
import pytest


@pytest.fixture(autouse=True)
def promotion():
    with jax.numpy_rank_promotion("allow"), jax.numpy_dtype_promotion("standard"):
        yield
