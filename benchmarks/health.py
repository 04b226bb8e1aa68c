"""What it costs to look for numbers that are none: runs with and without, call by call in turn.

    python -m benchmarks.health [ROUNDS]

The seconds are the processor's, of a call that lives five generations of one seed; the ratio is of medians.
"""

import sys
import time
from typing import Any
from unittest import mock

import jax
import jax.numpy as jnp
import numpy as np
from benchmarks.seeds import first_state

from skillcrew.algorithms.registry import make_algorithm
from skillcrew.envs.registry import make
from skillcrew.experiment import generation
from skillcrew.experiment.config import RunConfig

CASES = (
    ("madys-plus", "rover-t2-c1"),
    ("madys-plus", "rover-t3-c3"),
    ("madys", "rover-t2-c2"),
    ("ea", "rover-t2-c2"),
)


def program(method: str, environment: str, looks: bool) -> tuple[Any, Any]:
    """The compiled chunk of a run, and its first state."""
    algorithm = make_algorithm(method, make(environment))
    config = RunConfig(seeds=(2000,))
    state = first_state(algorithm, config)
    if looks:
        return generation.CompiledChunk(algorithm, config, state), state
    with mock.patch.object(generation, "is_sound", lambda _: jnp.ones((), bool)):
        return generation.CompiledChunk(algorithm, config, state), state


def main() -> None:
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 12
    print("| algorithm | environment | with | without | ratio |\n|---|---|---|---|---|")
    for method, environment in CASES:
        programs = {looks: program(method, environment, looks) for looks in (True, False)}
        seconds: dict[bool, list[float]] = {True: [], False: []}
        for turn in range(rounds):
            for looks in (True, False) if turn % 2 else (False, True):
                compiled, state = programs[looks]
                began = time.process_time()
                state, *_ = jax.block_until_ready(compiled(state))
                seconds[looks].append(time.process_time() - began)
                programs[looks] = (compiled, state)
        of = {looks: float(np.median(spent[2:])) for looks, spent in seconds.items()}
        row = f"{of[True]:.3f} s | {of[False]:.3f} s | {of[True] / of[False]:.3f}"
        print(f"| `{method}` | `{environment}` | {row} |", flush=True)


if __name__ == "__main__":
    main()
