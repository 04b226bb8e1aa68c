"""An algorithm that is trained for some generations, and looked at, in one program."""

from collections.abc import Callable
from typing import Any

import jax


def trained(algorithm: Any, generations: int, then: Callable[[Any], Any]) -> tuple[Any, dict]:
    """What comes of the state after some generations, and their metrics; all of it is one program."""

    def run(key):
        step, state = lambda state, _: algorithm.step(state), algorithm.init(key)
        state, metrics = jax.lax.scan(step, state, length=generations)
        return then(state), metrics

    return jax.jit(run)(jax.random.key(0))
