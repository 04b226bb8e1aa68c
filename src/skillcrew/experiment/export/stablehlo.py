"""A team's act as StableHLO, the portable form of compiled programs (`jax.export`)."""

from typing import Any

import jax
import jax.numpy as jnp
from jax import export

from skillcrew.experiment.export.interface import Interface
from skillcrew.experiment.export.walking import plain

PLATFORMS = ("cpu", "cuda", "rocm", "tpu")


def stablehlo(team: Any, interface: Interface, draws: bool) -> bytes:
    """The program, for any number of worlds side by side: every array has them as its first axis.

    Args:
        draws: whether the team draws what it does; a key for each world, as `jax.random.key_data` gives it,
            is then the last input.
    """

    def one_world(*inputs: Any) -> list[Any]:
        *seen, data = inputs
        return interface.play(team, seen, jax.random.wrap_key_data(data))

    data = jax.eval_shape(lambda: jax.random.key_data(jax.random.key(0)))
    like = [*(port.struct for port in (*interface.observation, *interface.memory)), data]
    operations = plain(one_world, *like)
    (worlds,) = export.symbolic_shape("worlds")
    many = [jax.ShapeDtypeStruct((worlds, *one.shape), one.dtype) for one in like]
    if draws:
        program = jax.jit(jax.vmap(operations))
    else:
        many.pop()
        program = jax.jit(jax.vmap(lambda *seen: operations(*seen, jnp.zeros(data.shape, data.dtype))))
    return bytes(export.export(program, platforms=PLATFORMS)(*many).serialize())
