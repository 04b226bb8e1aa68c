"""JaxMARL relies on JAX's usual promotion, from which our own tests are kept."""

import jax
import pytest

from experiment import tiny


@pytest.fixture(autouse=True)
def promotion():
    tiny.compile_once()
    with jax.numpy_rank_promotion("allow"), jax.numpy_dtype_promotion("standard"):
        yield
