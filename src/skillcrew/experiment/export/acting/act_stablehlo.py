"""The team in JAX alone, of many worlds: act({"observation": …}) begins, act({**before, …}) goes on."""

import json
import pathlib

import jax
import jax.numpy as jnp

HERE = pathlib.Path(__file__).parent
TEAM = json.loads((HERE / "team.json").read_text())
PROGRAM = jax.jit(jax.export.deserialize(bytearray((HERE / "team.stablehlo").read_bytes())).call)
INPUTS = [about["name"] for about in (*TEAM["observation"], *TEAM["memory"])]
RESULTS = [about["name"] for about in (*TEAM["outputs"], *TEAM["memory"])]


def act(inputs, *keys):
    """Arrays by name, worlds as first axis; where the team draws, an array of keys."""
    worlds = len(inputs[INPUTS[0]])
    start = {about["name"]: jnp.array([about["start"]] * worlds, about["dtype"]) for about in TEAM["memory"]}
    data = [jax.random.key_data(of_worlds) for of_worlds in keys]
    results = PROGRAM(*({**start, **inputs}[name] for name in INPUTS), *data)
    return dict(zip(RESULTS, results, strict=True))
