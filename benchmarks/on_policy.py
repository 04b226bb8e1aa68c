"""The whole loop of policy gradients on one core: episodes, advantages, updates.

`python -m benchmarks.on_policy` prints a page and writes `benchmarks/results/on_policy.md`. The process pins
itself to one core and one thread before JAX starts; seconds are the processor's. Rounds go round the sides,
so that what disturbs the machine meets all, and the plain product of two matrices is measured in each.
"""

import os
import statistics
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

if __name__ == "__main__":
    os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})

import jax
import jax.numpy as jnp
from benchmarks.machine import cpu_model, software, versions

import skillcrew as sc

PAGE = Path(__file__).parent / "results" / "on_policy.md"
TASK = "rover-t2-c2"
SMALL = sc.PolicyConfig(hidden=(32, 32), sharing="team")
REMEMBERS = sc.PolicyConfig(hidden=(64,), memory=32, sharing="team")
SIDES: dict[str, Callable[[Any], Any]] = {
    "IPPO, defaults": sc.IPPO,
    "MAPPO, defaults": sc.MAPPO,
    "IPPO, two layers of 32, 4 epochs": lambda env: sc.IPPO(
        env, policy=SMALL, critic=SMALL, ppo=sc.PPOConfig(epochs=4)
    ),
    "MAPPO, GRU of 32": lambda env: sc.MAPPO(env, policy=REMEMBERS, critic=REMEMBERS),
    "LIIR, defaults": sc.LIIR,
}
ROUNDS, GENERATIONS = 5, 10
HEAD = """# Policy gradients on one core

{machine}; {software}.
`{task}`, primitive actions; medians of {rounds} rounds of {generations} generations each. The plain product
is of two matrices of 1024.

| what | environment steps per second | milliseconds per generation |
|---|---|---|"""


class Running:
    """An algorithm that lives one generation after the other."""

    def __init__(self, algorithm: Any):
        self._step = jax.jit(algorithm.step, donate_argnums=0)
        self._state, _ = self._step(jax.jit(algorithm.init)(jax.random.key(0)))
        self.rates: list[float] = []
        self.seconds: list[float] = []

    def go_on(self) -> None:
        """Some generations, measured."""
        before = int(jax.block_until_ready(self._state).environment_steps)
        began = time.process_time()
        for _ in range(GENERATIONS):
            self._state, _ = self._step(self._state)
        jax.block_until_ready(self._state)
        taken = time.process_time() - began
        self.rates.append((int(self._state.environment_steps) - before) / taken)
        self.seconds.append(taken / GENERATIONS)


def plain_product(size: int = 1024) -> float:
    """Floating point operations per second."""
    matrix = jax.random.normal(jax.random.key(0), (size, size))
    multiply = jax.jit(jnp.matmul)
    jax.block_until_ready(multiply(matrix, matrix))
    began = time.process_time()
    jax.block_until_ready([multiply(matrix, matrix) for _ in range(10)])
    return 10 * 2 * size**3 / (time.process_time() - began)


def main() -> None:
    """Measures every side, prints the page and writes it."""
    env = sc.make(TASK)
    running = {title: Running(make(env)) for title, make in SIDES.items()}
    plain = []
    for _ in range(ROUNDS):
        plain.append(plain_product())
        for side in running.values():
            side.go_on()
    installed = software(versions(["jax"]))
    page = [
        HEAD.format(
            machine=cpu_model(), software=installed, task=TASK, rounds=ROUNDS, generations=GENERATIONS
        )
    ]
    for title, side in running.items():
        rate, seconds = statistics.median(side.rates), statistics.median(side.seconds)
        page.append(f"| {title} | {rate:,.0f} | {1e3 * seconds:.1f} |")
    page.append(f"\nThe plain product: {statistics.median(plain) / 1e9:.0f} GFLOP/s.")
    print("\n".join(page))
    PAGE.write_text("\n".join(page) + "\n")


if __name__ == "__main__":
    main()
