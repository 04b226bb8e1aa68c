"""Five seeds as one vmapped program against the same five one after another, at 1 and at 6 rovers.

`python -m benchmarks.seeds` prints a table and writes `benchmarks/results/seeds.md`. The rounds of the
two ways alternate, so that what disturbs the machine meets both; a ratio is the median of the rounds'.
"""

import argparse
import statistics
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax
from benchmarks.machine import cpu_model, software, versions

from skillcrew.algorithms.algorithm import Algorithm
from skillcrew.algorithms.registry import make_algorithm
from skillcrew.envs.registry import make
from skillcrew.experiment import generation
from skillcrew.experiment.config import RunConfig
from skillcrew.experiment.generation import RunState

PAGE = Path(__file__).parent / "results" / "seeds.md"
SEEDS = (2000, 2001, 2002, 2003, 2004)
CASES = tuple((method, name) for method in ("madys", "madys-es") for name in ("rover-t2-c1", "rover-t3-c3"))


def program(method: str, environment: str, seeds: tuple[int, ...], generations: int) -> Any:
    """The compiled chunk of a run with these seeds, its first state, and the seconds that compiling took."""
    algorithm = make_algorithm(method, make(environment))
    config = RunConfig(seeds=seeds, generations_per_report=generations)
    state = first_state(algorithm, config)
    began = time.perf_counter()
    compiled = generation.CompiledChunk(algorithm, config, state)
    return compiled, state, time.perf_counter() - began


def first_state(algorithm: Algorithm, config: RunConfig) -> RunState:
    """The state before the first generation; compiled, for what is donated may not share memory."""
    seeds = generation.seeds_of(config)
    return jax.jit(jax.vmap(lambda seed: generation.initial_state(algorithm, seed)))(seeds)


def timed(compiled: Callable[[RunState], Any], state: RunState) -> tuple[RunState, float]:
    """The state after a chunk, and the seconds it took."""
    began = time.perf_counter()
    state, _ = jax.block_until_ready(compiled(state))
    return state, time.perf_counter() - began


def compare(method: str, environment: str, generations: int, rounds: int) -> str:
    """One row of the table."""
    together, state, compile_together = program(method, environment, SEEDS, generations)
    alone, _, compile_alone = program(method, environment, SEEDS[:1], generations)
    algorithm = make_algorithm(method, make(environment))
    states = [first_state(algorithm, RunConfig(seeds=(seed,))) for seed in SEEDS]
    seconds_together, seconds_alone = [], []
    for _ in range(rounds + 1):
        state, seconds = timed(together, state)
        seconds_together.append(seconds)
        total = 0.0
        for index in range(len(SEEDS)):
            states[index], seconds = timed(alone, states[index])
            total += seconds
        seconds_alone.append(total)
    # The first round warms up.
    pairs = list(zip(seconds_together[1:], seconds_alone[1:], strict=True))
    ratio = statistics.median(apart / joined for joined, apart in pairs)
    joined, apart = (statistics.median(column) for column in zip(*pairs, strict=True))
    rovers = make(environment).n_agents
    return (
        f"| {method} | {environment} | {rovers} | {joined / generations:.2f} s | {apart / generations:.2f} s "
        f"| {ratio:.2f} | {compile_together:.0f} s, {compile_alone:.0f} s |"
    )


def main() -> None:
    """Measures every case, prints the table and writes the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--generations", type=int, default=3, help="per round")
    options = parser.parse_args()
    lines = [
        "# Five seeds: one program against one after another",
        "",
        f"{cpu_model()}; device {jax.devices()[0].device_kind}; {software(versions(('jax', 'equinox')))}",
        "",
        "| algorithm | environment | rovers | a generation of five seeds, vmapped | one after another "
        "| ratio | compiling, vmapped and alone |",
        "|---|---|---|---|---|---|---|",
    ]
    for method, environment in CASES:
        lines.append(compare(method, environment, options.generations, options.rounds))
        print(lines[-1], flush=True)
    lines += [
        "",
        f"Medians of {options.rounds} alternating rounds of {options.generations} generations, at the",
        "start of a run, while all skills learn. A ratio above 1 means that vmapped is faster; compiling is",
        "not counted in it, and is done once either way.",
    ]
    PAGE.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
