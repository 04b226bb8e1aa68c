"""The feed-forward network under every policy and critic."""

import dataclasses
import itertools
from typing import Literal, get_args

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Key

from skillcrew.envs.environment import Environment, ObservationScaling
from skillcrew.errors import UserError, unknown_name

InputScaling = Literal["environment"] | ObservationScaling
NAMES = ("environment", *get_args(ObservationScaling))

MOST_UNITS = 8192
"""Of a layer. One network of each kind is made before memory is counted, and XLA ends the whole process where
the number of weights overflows."""


@dataclasses.dataclass(frozen=True)
class NetworkConfig:
    """Size and input of a feed-forward network."""

    hidden: tuple[int, ...] = (64, 64)
    """Units of each hidden layer (rectified linear); none for a linear map."""
    input_scaling: InputScaling = "environment"
    """"symlog": sign(x)·log(1 + |x|); "sqrt": 2·sign(x)·√|x|, which turns a sensor's 1/δ² into 2/δ; "none":
    as it comes; "environment": what the environment names."""

    def __post_init__(self) -> None:
        if any(not isinstance(size, int) or size < 1 for size in self.hidden):
            raise UserError(f"hidden = {self.hidden}: give each layer at least 1 unit, or no layer at all")
        if max(self.hidden, default=0) > MOST_UNITS:
            raise UserError(f"hidden = {self.hidden}: give each layer at most {MOST_UNITS} units")
        if self.input_scaling not in NAMES:
            raise unknown_name("input_scaling", str(self.input_scaling), NAMES)

    @property
    def scaling(self) -> ObservationScaling:
        """What a network made of this does with its input."""
        return Environment.input_scaling if self.input_scaling == "environment" else self.input_scaling


def scale_input(x: Float[Array, "*any"], scaling: ObservationScaling) -> Float[Array, "*any"]:
    """Brings observations to the scale on which networks learn; see `NetworkConfig.input_scaling`."""
    match scaling:
        case "none":
            return x
        case "sqrt":
            return 2 * jnp.sign(x) * jnp.sqrt(jnp.abs(x))
        case "symlog":
            return jnp.sign(x) * jnp.log1p(jnp.abs(x))


class MLP(eqx.Module):
    """Rectified linear layers and a linear last one. Stack many by `jax.vmap(MLP.create…)`.

    Weights are normal with variance 2/inputs (He), so that activations keep their scale through
    rectified layers; the last layer's have variance 1/inputs; biases start at 0.
    """

    weights: tuple[Float[Array, "..."], ...]
    biases: tuple[Float[Array, "..."], ...]

    @classmethod
    def create(cls, key: Key[Array, ""], sizes: tuple[int, ...]) -> "MLP":
        """Draws a network with `sizes` = (inputs, hidden…, outputs)."""
        shapes = list(itertools.pairwise(sizes))
        # One draw for all layers: each random operation of its own takes XLA long to compile.
        draw = jax.random.normal(key, (sum(inputs * outputs for inputs, outputs in shapes),))
        weights, start = [], 0
        for layer, (inputs, outputs) in enumerate(shapes):
            is_last = layer == len(shapes) - 1
            deviation = inputs**-0.5 if is_last else (2 / inputs) ** 0.5
            weights.append(deviation * draw[start : start + inputs * outputs].reshape(inputs, outputs))
            start += inputs * outputs
        return cls(tuple(weights), tuple(jnp.zeros(size) for size in sizes[1:]))

    def silent(self) -> "MLP":
        """The same layers, but the last one's weights are 0, and so are all outputs."""
        weights = (*self.weights[:-1], jnp.zeros_like(self.weights[-1]))
        return MLP(weights, (*self.biases[:-1], jnp.zeros_like(self.biases[-1])))

    def __call__(self, x: Float[Array, " inputs"]) -> Float[Array, " outputs"]:
        return self.beyond(x @ self.weights[0])

    def beyond(self, sums: Float[Array, " units"]) -> Float[Array, " outputs"]:
        """The outputs, of what the first layer's weights make of an input."""
        x = sums + self.biases[0]
        for weight, bias in zip(self.weights[1:], self.biases[1:], strict=True):
            x = jax.nn.relu(x) @ weight + bias
        return x
