"""The team in ONNX Runtime: act({"observation": …}) begins, act({**before, "observation": …}) goes on."""

import json
import pathlib

import numpy as np
import onnxruntime

HERE = pathlib.Path(__file__).parent
MEMORY = json.loads((HERE / "team.json").read_text())["memory"]
START = {about["name"]: np.array(about["start"], about["dtype"]) for about in MEMORY}
SESSION = onnxruntime.InferenceSession(HERE / "team.onnx", providers=["CPUExecutionProvider"])
INPUTS = [port.name for port in SESSION.get_inputs()]
RESULTS = [port.name.removeprefix("next/") for port in SESSION.get_outputs()]


def act(inputs):
    """Arrays by name, as team.json lists them, to "action", "choice" and what is remembered."""
    given = {**START, **inputs}
    return dict(zip(RESULTS, SESSION.run(None, {name: given[name] for name in INPUTS}), strict=True))
