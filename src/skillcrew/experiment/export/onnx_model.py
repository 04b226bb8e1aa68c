"""A `Program` as an ONNX model."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from skillcrew.errors import UserError
from skillcrew.experiment.export.interface import Port
from skillcrew.experiment.export.program import Program

OPSET = 18
"""Version of ONNX's operations, of 2022: the runtimes on robots are not the newest."""

IR_VERSION = 8
"""Of the file; the one that came with it."""

WORDS = {
    **{"add": "Add", "subtract": "Sub", "multiply": "Mul", "divide": "Div", "fmod": "Mod", "negative": "Neg"},
    **{
        "sign": "Sign",
        "abs": "Abs",
        "sqrt": "Sqrt",
        "ceil": "Ceil",
        "exp": "Exp",
        "log": "Log",
        "tanh": "Tanh",
    },
    **{"minimum": "Min", "maximum": "Max", "min": "ReduceMin", "max": "ReduceMax", "sum": "ReduceSum"},
    **{"argmax": "ArgMax", "equal": "Equal", "less": "Less", "greater": "Greater"},
    **{"greater_equal": "GreaterOrEqual", "logical_and": "And", "logical_not": "Not"},
    **{"where": "Where", "reshape": "Reshape", "broadcast_to": "Expand", "transpose": "Transpose"},
    **{"pad": "Pad", "cast": "Cast", "concatenate": "Concat", "slice": "Slice", "rows": "GatherND"},
    "einsum": "Einsum",
}
"""ONNX's for those of a `Node`."""

AXIS = {"sum", "min", "max"}

AS_INPUTS: Mapping[str, Callable[..., list[Any]]] = {
    **{word: lambda axis: [[axis]] for word in AXIS},
    "reshape": lambda shape: [shape],
    "broadcast_to": lambda shape: [shape],
    "slice": lambda starts, ends: [starts, ends],
    "pad": lambda widths: [[before for before, _ in widths] + [behind for _, behind in widths]],
}
"""Attributes that ONNX takes as further inputs."""

AS_ATTRIBUTES: Mapping[str, Callable[..., dict[str, Any]]] = {
    **{word: lambda axis: {"keepdims": 0} for word in AXIS},
    "argmax": lambda axis: {"axis": axis, "keepdims": 0},
    "concatenate": lambda axis: {"axis": axis},
    "transpose": lambda axes: {"perm": axes},
    "einsum": lambda equation: {"equation": equation},
    "fmod": lambda: {"fmod": 1},
    "cast": lambda dtype: {"to": dtype},
}
"""And those that it names."""


def onnx_model(program: Program) -> bytes:
    """The model, as the bytes of its file. Constants that no file of ours holds are part of it.

    Raises:
        UserError: the package onnx is not installed.
    """
    onnx = imported()
    helper, constants, nodes = onnx.helper, dict(program.constants), []
    for node in program.nodes:
        inputs = list(node.inputs)
        for number, value in enumerate(AS_INPUTS.get(node.word, lambda *_: [])(*node.attributes)):
            inputs.append(f"{node.output}/{number}")
            constants[inputs[-1]] = np.array(value, np.int64)
        attributes = AS_ATTRIBUTES.get(node.word, lambda *_: {})(*node.attributes)
        if "to" in attributes:
            attributes["to"] = _type(helper, attributes["to"])
        nodes.append(helper.make_node(WORDS[node.word], inputs, [node.output], node.output, **attributes))
    for port in program.outputs:
        nodes.append(helper.make_node("Identity", [program.results[port.name]], [port.name], port.name))
    graph = helper.make_graph(
        nodes,
        "team",
        [_info(helper, port) for port in (*program.inputs, *program.draws)],
        [_info(helper, port) for port in program.outputs],
        [onnx.numpy_helper.from_array(array, name) for name, array in constants.items()],
    )
    opset = [helper.make_opsetid("", OPSET)]
    model = helper.make_model(graph, opset_imports=opset, producer_name="skillcrew", ir_version=IR_VERSION)
    onnx.checker.check_model(model, full_check=True)
    return model.SerializeToString()


def imported() -> Any:
    """The package onnx.

    Raises:
        UserError: it is not installed.
    """
    try:
        import onnx
    except ImportError as error:
        raise UserError(
            "formats = onnx: needs the package onnx, pip install 'skillcrew[onnx]'; or give --formats "
            "safetensors,stablehlo"
        ) from error
    return onnx


def _info(helper: Any, port: Port) -> Any:
    return helper.make_tensor_value_info(port.name, _type(helper, port.dtype), port.shape)


def _type(helper: Any, dtype: str) -> int:
    return helper.np_dtype_to_tensor_dtype(np.dtype(dtype))
