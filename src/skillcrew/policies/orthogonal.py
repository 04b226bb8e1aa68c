"""Orthogonal weights to begin with, as policy gradients are usually begun (Saxe et al. 2014)."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Key

from skillcrew.policies.memory import MemoryNetwork
from skillcrew.policies.network import MLP

RECTIFIED = 2**0.5
"""The gain of hidden layers, which makes up for what rectification takes."""

ITERATIONS = 60
"""Each makes a small singular value half as large again, until it is near 1: enough for one of 1e-9."""


def begun_orthogonally(key: Key[Array, ""], network: MemoryNetwork, last_gain: float) -> MemoryNetwork:
    """The same network with new weights: all matrices orthogonal, biases as they are.

    Args:
        last_gain: of the last layer; small, so that a policy begins with nearly equal probabilities.
    """
    mlp = network.network
    assert isinstance(mlp, MLP)
    *keys, key_unit = jax.random.split(key, len(mlp.weights) + 1)
    gains = [RECTIFIED] * (len(mlp.weights) - 1) + [last_gain]
    weights = tuple(
        _orthogonal(k, weight, gain) for k, weight, gain in zip(keys, mlp.weights, gains, strict=True)
    )
    unit = network.unit
    if unit is not None:
        key_input, key_hidden = jax.random.split(key_unit)
        matrices = (_orthogonal(key_input, unit.weight_ih, 1.0), _orthogonal(key_hidden, unit.weight_hh, 1.0))
        unit = eqx.tree_at(lambda u: (u.weight_ih, u.weight_hh), unit, matrices)
    return dataclasses.replace(network, network=MLP(weights, mlp.biases), unit=unit)


def _orthogonal(key: Key[Array, ""], weight: Array, gain: float) -> Array:
    """A random matrix with orthonormal rows or columns, whichever are fewer, times `gain`.

    The nearest such matrix to a normal one, by the iteration of Newton and Schulz: products of matrices.
    A QR decomposition is LAPACK's, and several at once were seen to wait for each other for ever in XLA's
    pool of two threads.
    """
    draw = jax.random.normal(key, weight.shape, weight.dtype)
    is_wide = weight.shape[0] < weight.shape[1]
    tall = draw.T if is_wide else draw

    def nearer(_: Array, x: Array) -> Array:
        return 1.5 * x - 0.5 * x @ (x.T @ x)

    tall = jax.lax.fori_loop(0, ITERATIONS, nearer, tall / jnp.linalg.norm(tall))
    return gain * (tall.T if is_wide else tall)
