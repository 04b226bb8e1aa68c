"""A generation of every algorithm beside one of MADyS, and what a run spends outside the compiled program.

`python -m benchmarks.family` prints a table and writes `benchmarks/results/family.md`. Rounds go round the
algorithms, so that what disturbs the machine meets all; a ratio is the median of the rounds' ratios.
"""

import argparse
import json
import math
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax
from benchmarks.machine import cpu_model, software, versions
from benchmarks.seeds import first_state, timed

import skillcrew as sc
from skillcrew.algorithms.algorithm import Algorithm
from skillcrew.experiment import generation
from skillcrew.experiment.config import RunConfig

PAGE = Path(__file__).parent / "results" / "family.md"
SIZES = {"population": 40, "episodes": 5}
UPDATES = 100
SEED = 3000
GENERATIONS = 5
WIDE = sc.NetworkConfig(hidden=(64, 64))


def algorithms(environment: str) -> dict[str, Algorithm]:
    """Every algorithm with the same population, episodes, updates and learners' networks as MADyS."""
    env = sc.make(environment)
    made: dict[str, Any] = {
        "madys": sc.MADyS(env, **SIZES, updates=UPDATES),
        "mfl, pre-training": sc.MFL(env, **SIZES, updates=UPDATES),
        "ea": sc.EA(env, **SIZES),
        "ccea": sc.CCEA(env, **SIZES),
        "td3, 10 episodes": sc.IndependentTD3(env, updates=UPDATES),
        "cerl, 4 learners": sc.CERL(env, **SIZES, updates=UPDATES),
        "erl": sc.ERL(env, **SIZES, updates=UPDATES),
    }
    for sharing in ("trunk", "agent"):
        merl = sc.MERL(env, **SIZES, updates=UPDATES, sharing=sharing)
        wide = sc.MERL(env, **SIZES, updates=UPDATES, sharing=sharing, learner=_wider(merl.config.learner))
        made[f"merl, {sharing}"] = merl
        made[f"merl, {sharing}, network of madys' skills"] = wide
    return made


def _wider(learner: sc.TD3Config) -> sc.TD3Config:
    fields = {name: getattr(learner, name) for name in learner.__dataclass_fields__}
    return sc.TD3Config(**{**fields, "network": WIDE})


def seconds_per_generation(environment: str, rounds: int) -> dict[str, list[float]]:
    """Wall seconds of a generation of each algorithm, in each round."""
    config = RunConfig(seeds=(SEED,), generations_per_report=GENERATIONS)
    programs: dict[str, tuple[Callable, Any]] = {}
    for name, algorithm in algorithms(environment).items():
        state = first_state(algorithm, config)
        programs[name] = (generation.CompiledChunk(algorithm, config, state), state)
    seconds: dict[str, list[float]] = {name: [] for name in programs}
    for _ in range(rounds + 1):
        for name, (compiled, state) in programs.items():
            state, spent = timed(compiled, state)
            programs[name] = (compiled, state)
            seconds[name].append(spent / GENERATIONS)
    # The first round warms up.
    return {name: values[1:] for name, values in seconds.items()}


def share_outside(algorithm: Algorithm, generations: int) -> float:
    """Share of a run's time, from its first generation to its last checkpoint, outside the program."""
    steps = generations * _most_steps(algorithm)
    inside = 0.0
    compile_chunk = generation.CompiledChunk

    def measured(*arguments: Any) -> Callable:
        compiled = compile_chunk(*arguments)

        def call(*given: Any) -> Any:
            nonlocal inside
            began = time.monotonic()
            result = jax.block_until_ready(compiled(*given))
            inside += time.monotonic() - began
            return result

        return call

    generation.CompiledChunk = measured
    try:
        with tempfile.TemporaryDirectory() as folder:
            run = sc.train(algorithm, seeds=(SEED,), steps=steps, out=Path(folder) / "run")
            timing = run.folder.timing.read_text()
    finally:
        generation.CompiledChunk = compile_chunk
    total = next(entry["seconds"] for entry in json.loads(timing) if "seconds" in entry)
    return 1 - inside / total


def _most_steps(algorithm: Algorithm) -> int:
    """Environment steps of the first generation, whose episodes nearly all last to their time limit."""
    state = jax.jit(algorithm.init)(jax.random.key(SEED))
    return int(jax.jit(algorithm.step)(state)[1]["environment_steps"])


def page(environment: str, rounds: int, duration: float) -> list[str]:
    """The table of one environment."""
    seconds = seconds_per_generation(environment, rounds)
    lines = [f"## {environment}", "", "| algorithm | a generation | of MADyS's | outside the program |"]
    lines.append("|---|---|---|---|")
    for name, algorithm in algorithms(environment).items():
        ratio = statistics.median(
            own / reference for own, reference in zip(seconds[name], seconds["madys"], strict=True)
        )
        spent = statistics.median(seconds[name])
        outside = share_outside(algorithm, math.ceil(duration / spent))
        lines.append(f"| {name} | {spent * 1e3:.0f} ms | {ratio:.2f} | {outside:.1%} |")
        print(lines[-1], flush=True)
    return [*lines, ""]


def main() -> None:
    """Measures, prints and writes the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=20, help="of each run in the last column")
    parser.add_argument("environments", nargs="*", default=["rover-t2-c2"])
    options = parser.parse_args()
    lines = [
        "# A generation of each algorithm",
        "",
        f"{cpu_model()}; device {jax.devices()[0].device_kind}; {software(versions(('jax', 'equinox')))}.",
        "",
        f"One seed, {SIZES['population']} teams of {SIZES['episodes']} episodes, {UPDATES} updates for each",
        f"learner and generation, at the start of a run; medians of {options.rounds} rounds of {GENERATIONS}",
        "generations, in turn. The last column is of a run of its own, of",
        f"about {options.seconds:.0f} seconds: the share of its time that was spent",
        "on metrics, progress and checkpoints. Scoring champions on fresh episodes is inside the program.",
        "",
    ]
    for environment in options.environments:
        lines += page(environment, options.rounds, options.seconds)
    PAGE.write_text("\n".join(lines))


if __name__ == "__main__":
    main()
