"""A gated recurrent unit and the network behind it, in NumPy.

Cho et al. 2014, with the reset gate on the recurrent product, as Equinox's `GRUCell` has it. There the three
blocks of rows are those of the reset gate, of the update gate and of the candidate; the candidate's recurrent
product has a bias of its own.
"""

from typing import Any

import numpy as np

from oracles.td3 import Net


def sigmoid(x: np.ndarray) -> np.ndarray:
    return 1 / (1 + np.exp(-x))


def gated_recurrent_unit(unit: Any, x: np.ndarray, h: np.ndarray) -> np.ndarray:
    """The next hidden state."""
    of_input = np.split(np.asarray(unit.weight_ih, np.float64), 3)
    of_memory = np.split(np.asarray(unit.weight_hh, np.float64), 3)
    bias = np.split(np.asarray(unit.bias, np.float64), 3)
    reset = sigmoid(of_input[0] @ x + of_memory[0] @ h + bias[0])
    update = sigmoid(of_input[1] @ x + of_memory[1] @ h + bias[1])
    recurrent = of_memory[2] @ h + np.asarray(unit.bias_n, np.float64)
    candidate = np.tanh(of_input[2] @ x + bias[2] + reset * recurrent)
    return update * h + (1 - update) * candidate


def scaled(seen: np.ndarray, scaling: str) -> np.ndarray:
    """What a network makes of its input before the first layer."""
    size = np.abs(seen)
    return np.sign(seen) * {"sqrt": 2 * np.sqrt(size), "symlog": np.log(1 + size), "none": size}[scaling]


def remember(network: Any, observation: np.ndarray, memory: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The outputs of one `MemoryNetwork` and its new memory, without a recurrent unit as well."""
    seen = scaled(np.asarray(observation, np.float64), network.input_scaling)
    if network.unit is not None:
        memory = gated_recurrent_unit(network.unit, seen, memory)
        seen = np.concatenate([seen, memory])
    layers = network.network
    net = Net([np.asarray(w) for w in layers.weights], [np.asarray(b) for b in layers.biases])
    return net.forward(seen[None])[0][0], memory
