"""What difference rewards cost: a step with the credit of every agent beside a plain one, on one core.

`python -m benchmarks.counterfactuals` prints a table and writes `benchmarks/results/counterfactuals.md`.
Rounds go round the sides, so that what disturbs the machine meets all; a ratio is the median of the rounds'.
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
from skillcrew.credit.difference import credited
from skillcrew.envs.environment import Environment

PAGE = Path(__file__).parent / "results" / "counterfactuals.md"
CASES = ("rover-t2-c2", "rover-t3-c3", "rover-t3-c6", "rescue-v1-c2", "rescue-v3-c3")
WORLDS, STEPS, ROUNDS = 256, 50, 5

HEADER = """\
# Steps with difference rewards, one thread

{machine}; {software}.
{worlds} worlds, {steps} steps, {rounds} rounds; median seconds of the processor, as a multiple of a plain
step with all that it senses and pays, which they include. D has a world for each of N agents beside the one
that is lived in, D++ N².

| environment | agents | D | D++ |
|---|---|---|---|"""


def lived(env: Environment) -> Callable[[], Any]:
    """A compiled program of some steps in which everybody acts at random; all results are summed."""

    @jax.jit
    def live(state: Any) -> Any:
        keys = jax.random.split(jax.random.key(1), WORLDS)

        def step(carry: Any, time: Any) -> Any:
            state, total = carry
            key = jax.random.fold_in(jax.random.key(2), time)
            shape = (env.n_agents, env.action_size, WORLDS)
            state, said = env.step_worlds(state, jax.random.uniform(key, shape, minval=-1.0), keys)
            summed = sum(leaf.astype(jnp.float32).sum() for leaf in jax.tree.leaves(said))
            return (state, total + summed), None

        return jax.lax.scan(step, (state, jnp.zeros(())), jnp.arange(STEPS))[0][1]

    state, _ = jax.jit(env.reset_worlds)(jax.random.split(jax.random.key(0), WORLDS))
    jax.block_until_ready(live(state))
    return lambda: jax.block_until_ready(live(state))


def seconds(function: Callable[[], Any]) -> float:
    began = time.process_time()
    function()
    return time.process_time() - began


def row(name: str) -> str:
    """Of one environment."""
    env = sc.make(name)
    plain, *others = (lived(credited(env, reward)) for reward in ("team", "D", "D++"))
    ratios: list[list[float]] = [[] for _ in others]
    for _ in range(ROUNDS):
        of_plain = seconds(plain)
        for found, other in zip(ratios, others, strict=True):
            found.append(seconds(other) / of_plain)
    cells = (f"{statistics.median(found):.1f}" for found in ratios)
    return f"| `{name}` | {env.n_agents} | {' | '.join(cells)} |"


def main() -> None:
    """Measures every case, prints the table and writes the page."""
    found = software(versions(("jax",)))
    lines = [HEADER.format(machine=cpu_model(), software=found, worlds=WORLDS, steps=STEPS, rounds=ROUNDS)]
    print(lines[0], flush=True)
    for name in CASES:
        lines.append(row(name))
        print(lines[-1], flush=True)
    PAGE.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
