"""What is checked, and what all checks need of it."""

import dataclasses
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Key, PyTree

from skillcrew.envs.environment import Environment
from skillcrew.envs.padded import by_type, uniform


@dataclasses.dataclass(frozen=True)
class Subject:
    """An environment, and keys to play in it."""

    env: Environment
    key: Key[Array, ""]

    def draw(self, purpose: int) -> Key[Array, ""]:
        """A key for each purpose."""
        return jax.random.fold_in(self.key, purpose)

    @property
    def world(self) -> Environment:
        """The same, with arrays over all agents."""
        return uniform(self.env)

    def still(self) -> Array:
        """An action of zeros, as arrays over all agents are."""
        agents, size = self.env.n_agents, self.env.action_size
        return jnp.zeros(agents, jnp.int32) if self.env.choices else jnp.zeros((agents, size))

    def still_of(self) -> Any:
        """The same as the environment itself takes it."""
        types, still = self.env.types, self.still()
        return by_type(types, still, discrete=bool(self.env.choices)) if types else still

    def random(self, key: Key[Array, ""]) -> Array:
        """Any action, as arrays over all agents are."""
        env = self.env
        if env.choices:
            return jax.random.randint(key, (env.n_agents,), 0, env.choices)
        return jax.random.uniform(key, (env.n_agents, env.action_size), minval=-1.0, maxval=1.0)


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
