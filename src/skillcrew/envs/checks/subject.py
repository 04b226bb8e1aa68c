"""What is checked, and what all checks need of it."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Key, PyTree

from skillcrew.envs.environment import Environment


@dataclasses.dataclass(frozen=True)
class Subject:
    """An environment, and keys to play in it."""

    env: Environment
    key: Key[Array, ""]

    def draw(self, purpose: int) -> Key[Array, ""]:
        """A key for each purpose."""
        return jax.random.fold_in(self.key, purpose)

    def still(self) -> Float[Array, "agents act"]:
        """An action of zeros."""
        return jnp.zeros((self.env.n_agents, self.env.action_size))


def alike(first: PyTree, second: PyTree, tolerance: float = 0.0) -> bool:
    """Whether two trees hold the same numbers."""
    leaves, others = jax.tree.leaves(first), jax.tree.leaves(second)
    return len(leaves) == len(others) and all(
        np.allclose(_numbers(one), _numbers(other), tolerance, tolerance, equal_nan=True)
        for one, other in zip(leaves, others, strict=True)
    )


def _numbers(leaf: Array) -> np.ndarray:
    is_key = jax.dtypes.issubdtype(getattr(leaf, "dtype", None), jax.dtypes.prng_key)
    return np.asarray(jax.random.key_data(leaf) if is_key else leaf)
